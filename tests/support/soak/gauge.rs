//! The costs of the process, line by line, and their growth.

use std::time::{Duration, Instant};

use simd_client::Client;
use tokio::time::timeout;

use super::Stage;
use crate::http;

/// Seconds that are left out of the growth. Unused files, some of which the run sends each second, stay for
/// ten minutes, including those of the busier first five. At most this part of a run.
const WARM_UP: f64 = 16.0 * 60.0;
const WARM_UP_PART: f64 = 0.5;
/// Within this the daemon answers.
const ANSWERS: Duration = Duration::from_secs(10);

pub(super) struct Gauge {
    pid: u32,
    client: Option<Client>,
    begun: Instant,
    /// Since the last line.
    looks: Vec<Sample>,
    /// One for each line: means of its looks.
    samples: Vec<Sample>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Sample {
    /// Seconds since the start.
    at: f64,
    /// MiB that are allocated and not freed.
    heap: f64,
    /// MiB of memory that belongs to no file: heap, freed memory that the allocator keeps, stacks.
    anonymous: f64,
    /// MiB, with files.
    resident: f64,
    threads: f64,
    files: f64,
}

impl Sample {
    fn mean(samples: &[Self]) -> Self {
        let mean = |figure: fn(&Self) -> f64| samples.iter().map(figure).sum::<f64>() / samples.len() as f64;
        Self {
            at: mean(|it| it.at),
            heap: mean(|it| it.heap),
            anonymous: mean(|it| it.anonymous),
            resident: mean(|it| it.resident),
            threads: mean(|it| it.threads),
            files: mean(|it| it.files),
        }
    }
}

impl Gauge {
    /// Prints the head of the table.
    #[allow(clippy::print_stdout, reason = "a bench prints")]
    pub(super) async fn new(stage: &Stage, pid: Option<u32>) -> Self {
        println!(
            "   minute  heap MiB  anonymous  RSS MiB  threads  files   pace  overruns  step us  done      refused   age \
             of states when they are read, ms: p50, p99"
        );
        let client = Client::connect(&stage.endpoint).await.ok();
        let pid = pid.unwrap_or_default();
        Self { pid, client, begun: Instant::now(), looks: Vec::new(), samples: Vec::new() }
    }

    /// A process that is gone, and one that does not count its heap, are failures.
    pub(super) async fn look(&mut self, stage: &Stage) {
        let folder = format!("/proc/{}", self.pid);
        let Ok(status) = std::fs::read_to_string(format!("{folder}/status")) else {
            return stage.tally.fail("the daemon is gone".to_owned());
        };
        let address = stage.address;
        // In a separate task, since it panics without an answer.
        let asked = tokio::spawn(async move { http::get(address, "/metrics", &[]).await.text() });
        let Ok(Ok(metrics)) = timeout(ANSWERS, asked).await else {
            return stage.tally.fail("the daemon does not answer /metrics".to_owned());
        };
        let figure = |text: &str, name: &str| {
            let line = text.lines().find_map(|line| line.strip_prefix(name));
            line.and_then(|rest| rest.split_whitespace().next()?.parse::<f64>().ok())
        };
        let (Some(resident), Some(anonymous), Some(threads), Some(heap)) = (
            figure(&status, "VmRSS:"),
            figure(&status, "RssAnon:"),
            figure(&status, "Threads:"),
            figure(&metrics, "simd_heap_bytes "),
        ) else {
            return stage.tally.fail("the daemon does not say what it has allocated".to_owned());
        };
        self.looks.push(Sample {
            at: self.begun.elapsed().as_secs_f64(),
            heap: heap / 1_048_576.0,
            anonymous: anonymous / 1024.0,
            resident: resident / 1024.0,
            threads,
            files: std::fs::read_dir(format!("{folder}/fd")).map_or(0, Iterator::count) as f64,
        });
    }

    /// Prints a line: means since the last one.
    #[allow(clippy::print_stdout, reason = "a bench prints")]
    pub(super) async fn line(&mut self, stage: &Stage) {
        let mean = Sample::mean(&self.looks);
        self.looks.clear();
        let statistics = match &self.client {
            Some(client) => client.world_statistics().await.unwrap_or_default(),
            None => Default::default(),
        };
        let (done, refused) = stage.tally.totals();
        let mut line = format!(
            "  {:7.2} {:9.2} {:10.2} {:8.2} {:8.1} {:6.1} {:6.3} {:9} {:8.1}  {done:8}  {refused:8}",
            self.begun.elapsed().as_secs_f64() / 60.0,
            mean.heap,
            mean.anonymous,
            mean.resident,
            mean.threads,
            mean.files,
            statistics.real_time_factor,
            statistics.overruns,
            statistics.step_duration * 1e6,
        );
        for (transport, median, late) in stage.tally.take_ages() {
            line += &format!("  {transport} {median:.2}, {late:.2}");
        }
        println!("{line}");
        self.samples.push(mean);
    }

    fn end(&self) -> f64 {
        self.samples.last().map_or(0.0, |sample| sample.at)
    }

    fn warm_up(&self) -> f64 {
        WARM_UP.min(WARM_UP_PART * self.end())
    }

    /// Least squares over the time after the warm-up, per hour.
    fn slope(&self, figure: fn(&Sample) -> f64) -> Slope {
        let late = self.samples.iter().filter(|sample| sample.at >= self.warm_up());
        let points: Vec<(f64, f64)> = late.map(|sample| (sample.at / 3600.0, figure(sample))).collect();
        Slope::of(&points)
    }

    /// Growth of allocated memory, MiB an hour.
    pub(super) fn heap_slope(&self) -> Slope {
        self.slope(|sample| sample.heap)
    }

    /// Growth of the memory of the process, MiB an hour.
    pub(super) fn memory_slope(&self) -> Slope {
        self.slope(|sample| sample.anonymous)
    }

    /// Returns the growth of all figures that must not grow.
    pub(super) fn slopes(&self) -> String {
        format!(
            "slope after the first {:.1} minutes, an hour: heap {} MiB, anonymous memory {} MiB, threads {}, files {}",
            self.warm_up() / 60.0,
            self.heap_slope(),
            self.memory_slope(),
            self.slope(|sample| sample.threads),
            self.slope(|sample| sample.files),
        )
    }
}

/// Slope of the least-squares line through some points.
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

    /// Returns whether it is above a limit by more than its scatter explains: by two standard errors.
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
    fn scattered_memory_does_not_grow() {
        let slope = Slope::of(&[(0.0, 0.0), (0.1, 1.0), (0.2, 0.0), (0.3, 1.0)]);
        assert!(slope.value > 1.0 && !slope.is_above(1.0), "{slope:?}");
    }
}
