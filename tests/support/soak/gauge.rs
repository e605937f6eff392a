//! What the process costs, line by line, and how fast that grows.

use std::time::Instant;

use simd_client::Client;

use super::Stage;

/// The first part of a run fills caches, and says nothing about growth.
const WARM_UP: f64 = 0.2;

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

    /// Least squares over what comes after the warm-up, an hour.
    fn slope(&self, figure: fn(&Sample) -> f64) -> f64 {
        let late = self.samples.iter().filter(|sample| sample.at >= WARM_UP * self.end());
        let points: Vec<(f64, f64)> = late.map(|sample| (sample.at / 3600.0, figure(sample))).collect();
        slope(&points)
    }

    /// MiB an hour.
    pub(super) fn heap_slope(&self) -> f64 {
        self.slope(|sample| sample.anonymous)
    }

    /// Of all that must not grow.
    pub(super) fn slopes(&self) -> String {
        format!(
            "slope after the first {:.1} minutes, an hour: heap {:+.2} MiB, threads {:+.1}, files {:+.1}",
            WARM_UP * self.end() / 60.0,
            self.heap_slope(),
            self.slope(|sample| sample.threads),
            self.slope(|sample| sample.files),
        )
    }
}

/// Of the straight line nearest to these points; NaN of fewer than two.
fn slope(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let mean = |part: fn(&(f64, f64)) -> f64| points.iter().map(part).sum::<f64>() / count;
    let (x, y) = (mean(|point| point.0), mean(|point| point.1));
    let spread: f64 = points.iter().map(|point| (point.0 - x).powi(2)).sum();
    points.iter().map(|point| (point.0 - x) * (point.1 - y)).sum::<f64>() / spread
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_line_has_its_slope() {
        assert!((super::slope(&[(0.0, 1.0), (1.0, 3.0), (2.0, 5.0)]) - 2.0).abs() < 1e-12);
    }
}
