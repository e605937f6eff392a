//! What the process costs, line by line, and how fast that grows.

use std::time::Instant;

use simd_client::Client;

use super::Stage;

/// Seconds that say nothing about growth: files that no robot uses, of which the run sends some each second, stay for ten
/// minutes. No more than this part of a run.
const WARM_UP: f64 = 12.0 * 60.0;
const WARM_UP_PART: f64 = 0.4;

pub(super) struct Gauge {
    pid: u32,
    client: Option<Client>,
    begun: Instant,
    samples: Vec<Sample>,
}

struct Sample {
    /// Seconds since the start.
    at: f64,
    /// MiB of memory that is no file's: heap, stacks.
    anonymous: f64,
    threads: f64,
    files: f64,
}

impl Gauge {
    /// Prints the head of the table.
    #[allow(clippy::print_stdout, reason = "a bench prints")]
    pub(super) async fn new(stage: &Stage, pid: Option<u32>) -> Self {
        println!(
            "   minute  heap MiB  RSS MiB  threads  files   pace  overruns  step us  done      refused   age of \
             states when they are read, ms: p50, p99"
        );
        let client = Client::connect(&stage.endpoint).await.ok();
        Self { pid: pid.unwrap_or_default(), client, begun: Instant::now(), samples: Vec::new() }
    }

    /// Prints a line. A process that is gone is a failure.
    #[allow(clippy::print_stdout, reason = "a bench prints")]
    pub(super) async fn read(&mut self, stage: &Stage) {
        let folder = format!("/proc/{}", self.pid);
        let status = std::fs::read_to_string(format!("{folder}/status")).unwrap_or_default();
        let figure = |name: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(name));
            line.and_then(|rest| rest.split_whitespace().next()?.parse::<f64>().ok())
        };
        let (Some(rss), Some(anonymous), Some(threads)) =
            (figure("VmRSS:"), figure("RssAnon:"), figure("Threads:"))
        else {
            return stage.tally.fail("the daemon is gone".to_owned());
        };
        let files = std::fs::read_dir(format!("{folder}/fd")).map_or(0, Iterator::count);
        let at = self.begun.elapsed().as_secs_f64();
        let sample = Sample { at, anonymous: anonymous / 1024.0, threads, files: files as f64 };
        let statistics = match &self.client {
            Some(client) => client.world_statistics().await.unwrap_or_default(),
            None => Default::default(),
        };
        let (done, refused) = stage.tally.totals();
        let mut line = format!(
            "  {:7.2} {:9.2} {:8.2} {:8} {:6} {:6.3} {:9} {:8.1}  {done:8}  {refused:8}",
            at / 60.0,
            sample.anonymous,
            rss / 1024.0,
            threads,
            files,
            statistics.real_time_factor,
            statistics.overruns,
            statistics.step_duration * 1e6,
        );
        for (transport, median, late) in stage.tally.take_ages() {
            line += &format!("  {transport} {median:.2}, {late:.2}");
        }
        println!("{line}");
        self.samples.push(sample);
    }

    fn end(&self) -> f64 {
        self.samples.last().map_or(0.0, |sample| sample.at)
    }

    fn warm_up(&self) -> f64 {
        WARM_UP.min(WARM_UP_PART * self.end())
    }

    /// Least squares over what comes after the warm-up, an hour.
    fn slope(&self, figure: fn(&Sample) -> f64) -> Slope {
        let late = self.samples.iter().filter(|sample| sample.at >= self.warm_up());
        let points: Vec<(f64, f64)> = late.map(|sample| (sample.at / 3600.0, figure(sample))).collect();
        Slope::of(&points)
    }

    /// MiB an hour.
    pub(super) fn heap_slope(&self) -> Slope {
        self.slope(|sample| sample.anonymous)
    }

    /// Of all that must not grow.
    pub(super) fn slopes(&self) -> String {
        format!(
            "slope after the first {:.1} minutes, an hour: heap {} MiB, threads {}, files {}",
            self.warm_up() / 60.0,
            self.heap_slope(),
            self.slope(|sample| sample.threads),
            self.slope(|sample| sample.files),
        )
    }
}

/// Of the straight line that is nearest to some points.
#[derive(Clone, Copy, Debug, Default)]
pub struct Slope {
    /// NaN of fewer than two points.
    pub value: f64,
    /// The standard error of it; NaN of fewer than three points.
    pub error: f64,
}

impl Slope {
    fn of(points: &[(f64, f64)]) -> Self {
        let count = points.len() as f64;
        let mean = |part: fn(&(f64, f64)) -> f64| points.iter().map(part).sum::<f64>() / count;
        let (x, y) = (mean(|point| point.0), mean(|point| point.1));
        let spread: f64 = points.iter().map(|point| (point.0 - x).powi(2)).sum();
        let value = points.iter().map(|point| (point.0 - x) * (point.1 - y)).sum::<f64>() / spread;
        let residuals = points.iter().map(|point| (point.1 - y - value * (point.0 - x)).powi(2));
        Self { value, error: (residuals.sum::<f64>() / (count - 2.0) / spread).sqrt() }
    }

    /// Whether it is above a limit by more than its scatter explains: by two standard errors.
    pub fn is_above(self, limit: f64) -> bool {
        self.value - 2.0 * self.error > limit
    }
}

impl std::fmt::Display for Slope {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:+.2} +- {:.2}", self.value, self.error)
    }
}

#[cfg(test)]
mod tests {
    use super::Slope;

    #[test]
    fn a_line_has_its_slope_and_no_error() {
        let slope = Slope::of(&[(0.0, 1.0), (1.0, 3.0), (2.0, 5.0)]);
        assert!((slope.value - 2.0).abs() < 1e-12 && slope.error < 1e-12, "{slope:?}");
        assert!(slope.is_above(1.9) && !slope.is_above(2.1));
    }

    #[test]
    fn what_only_scatters_does_not_grow() {
        let slope = Slope::of(&[(0.0, 0.0), (0.1, 1.0), (0.2, 0.0), (0.3, 1.0)]);
        assert!(slope.value > 1.0 && !slope.is_above(1.0), "{slope:?}");
    }
}
