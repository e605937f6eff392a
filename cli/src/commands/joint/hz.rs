//! `simctl joint hz`: rate and jitter of a robot's joint states.

use std::{
    collections::VecDeque,
    time::{Duration, Instant},
};

use anyhow::bail;
use clap::Args;
use serde::Serialize;
use simd_client::{Client, every_joint};
use tokio::time::{MissedTickBehavior, interval_at};

use crate::{
    commands::ended,
    complete,
    output::{Output, View, number::fixed, table::Page},
};

/// Interval between two lines.
const REPORT: Duration = Duration::from_secs(1);

#[derive(Args, Debug)]
pub(crate) struct Hz {
    /// Name of the robot
    #[arg(add = complete::robots())]
    robot: String,
    /// Requested states per second: 0.1 to 1000
    #[arg(short, long, default_value_t = 100.0, value_name = "HZ")]
    rate: f64,
    /// End after this number of states
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..))]
    count: Option<u64>,
    /// End after this number of seconds
    #[arg(short, long, value_name = "SECONDS", value_parser = seconds)]
    seconds: Option<Duration>,
    /// Number of last states that figures cover: 2 to 100000
    #[arg(short, long, default_value_t = 10_000, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=100_000))]
    window: u32,
}

fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| "must be a number of seconds".to_owned())?;
    match Duration::try_from_secs_f64(seconds) {
        Ok(duration) if !duration.is_zero() => Ok(duration),
        _ => Err("must be above zero".to_owned()),
    }
}

/// Prints a line per second, and one at the end.
pub(super) async fn run(arguments: &Hz, client: &Client, output: Output) -> anyhow::Result<()> {
    let Hz { robot, rate, count, seconds, window } = arguments;
    let mut states = client.watch(vec![every_joint(robot)], *rate).await?;
    let begin = Instant::now();
    let mut intervals = Intervals::new(robot, *window as usize);
    let mut reports = interval_at(tokio::time::Instant::now() + REPORT, REPORT);
    reports.set_missed_tick_behavior(MissedTickBehavior::Skip);
    // Never ends without a given time.
    let over = async {
        match seconds {
            Some(seconds) => tokio::time::sleep(*seconds).await,
            None => std::future::pending().await,
        }
    };
    tokio::pin!(over);
    loop {
        tokio::select! {
            state = states.next() => {
                let state = state?.ok_or_else(|| ended(client))?;
                let step = state.stamp.map(|stamp| stamp.step).unwrap_or_default();
                intervals.add(begin.elapsed(), step);
                if count.is_some_and(|count| intervals.states >= count) {
                    break;
                }
            }
            _ = reports.tick() => output.item(&intervals.report(begin.elapsed()))?,
            () = &mut over => break,
            _ = tokio::signal::ctrl_c() => break,
        }
    }
    let mut report = intervals.report(begin.elapsed());
    report.is_silent = report.states == 0;
    let (states, was_asked) = (report.states, count.is_some() || seconds.is_some());
    output.item(&report)?;
    if states < 2 && was_asked {
        bail!(
            "{states} states of {robot} arrived, and a rate needs two; a paused world has none (`simctl sim \
             play`)"
        );
    }
    Ok(())
}

/// Times between the last states.
#[derive(Debug)]
struct Intervals {
    robot: String,
    window: usize,
    /// Seconds.
    between: VecDeque<f64>,
    last: Option<(Duration, u64)>,
    states: u64,
    since_report: u64,
    /// Steps of the world between the states of `between`.
    steps: VecDeque<u64>,
}

impl Intervals {
    fn new(robot: &str, window: usize) -> Self {
        Self {
            robot: robot.to_owned(),
            window,
            between: VecDeque::new(),
            last: None,
            states: 0,
            since_report: 0,
            steps: VecDeque::new(),
        }
    }

    /// Records a state that came at a time, with the world at a step.
    fn add(&mut self, at: Duration, step: u64) {
        if let Some((before, step_before)) = self.last.replace((at, step)) {
            // `window` states have one interval less.
            if self.between.len() + 1 >= self.window {
                self.between.pop_front();
                self.steps.pop_front();
            }
            self.between.push_back(at.saturating_sub(before).as_secs_f64());
            // It decreases when time is reset.
            self.steps.push_back(step.saturating_sub(step_before));
        }
        self.states += 1;
        self.since_report += 1;
    }

    fn report(&mut self, now: Duration) -> Report {
        let is_silent = std::mem::take(&mut self.since_report) == 0;
        let count = self.between.len() as f64;
        let mean = self.between.iter().sum::<f64>() / count;
        let variance = self.between.iter().map(|each| (each - mean).powi(2)).sum::<f64>() / count;
        let of = |value: f64| (!self.between.is_empty()).then_some(value);
        Report {
            robot: self.robot.clone(),
            elapsed: now.as_secs_f64(),
            states: self.states,
            window: self.between.len() + 1,
            is_silent,
            rate: of(1.0 / mean).filter(|rate| rate.is_finite()),
            mean: of(mean),
            min: of(self.between.iter().copied().fold(f64::INFINITY, f64::min)),
            max: of(self.between.iter().copied().fold(0.0, f64::max)),
            standard_deviation: of(variance.sqrt()),
            steps_between: of(self.steps.iter().sum::<u64>() as f64 / count),
        }
    }
}

/// A line of `joint hz`.
#[derive(Debug, Serialize)]
struct Report {
    robot: String,
    /// Wall seconds since the first request.
    elapsed: f64,
    /// Number of states since then.
    states: u64,
    /// Number of last states that the figures cover.
    window: usize,
    /// Whether no state came since the last line.
    is_silent: bool,
    /// Per second; null before the second state, like the following fields.
    rate: Option<f64>,
    /// Wall seconds between two states.
    mean: Option<f64>,
    min: Option<f64>,
    max: Option<f64>,
    standard_deviation: Option<f64>,
    /// Steps of the world between two states, mean.
    steps_between: Option<f64>,
}

impl View for Report {
    fn page(&self) -> Page {
        let milliseconds = |value: Option<f64>| fixed(value.unwrap_or_default() * 1e3, 3);
        Page::of_line(match self.rate {
            _ if self.is_silent => format!("no new state of {}; {} in all", self.robot, self.states),
            Some(rate) => format!(
                "{} Hz; between states: min {} ms, mean {} ms, max {} ms, std dev {} ms; window {}",
                fixed(rate, 3),
                milliseconds(self.min),
                milliseconds(self.mean),
                milliseconds(self.max),
                milliseconds(self.standard_deviation),
                self.window,
            ),
            None => format!("{} states of {} arrived", self.states, self.robot),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn milliseconds(times: &[u64], window: usize) -> Report {
        let mut intervals = Intervals::new("arm", window);
        (1..).zip(times).for_each(|(step, time)| intervals.add(Duration::from_millis(*time), 10 * step));
        intervals.report(Duration::from_secs(1))
    }

    fn near(value: Option<f64>, expected: f64) -> bool {
        (value.unwrap() - expected).abs() < 1e-12
    }

    #[test]
    fn figures_are_those_of_the_intervals() {
        // Intervals of 10, 30 and 20 ms: mean 20, variance (100 + 100 + 0) / 3.
        let report = milliseconds(&[100, 110, 140, 160], 10);
        assert!((report.rate.unwrap() - 50.0).abs() < 1e-9, "{report:?}");
        assert!(near(report.min, 0.01) && near(report.mean, 0.02) && near(report.max, 0.03), "{report:?}");
        assert!(near(report.standard_deviation, (200e-6_f64 / 3.0).sqrt()), "{report:?}");
        assert_eq!((report.states, report.window, report.steps_between), (4, 4, Some(10.0)));
    }

    #[test]
    fn a_window_has_the_last_states_alone() {
        let report = milliseconds(&[0, 500, 510, 520], 3);
        assert!((report.rate.unwrap() - 100.0).abs() < 1e-9, "{report:?}");
        assert_eq!((report.states, report.window), (4, 3));
    }

    #[test]
    fn one_state_has_no_rate_and_silence_is_reported() {
        let report = milliseconds(&[7], 3);
        assert_eq!((report.states, report.rate, report.min), (1, None, None));
        let mut intervals = Intervals::new("arm", 3);
        assert!(intervals.report(Duration::ZERO).is_silent);
        // Two states at the same time have no rate.
        let both = milliseconds(&[7, 7], 3);
        assert_eq!((both.rate, both.min), (None, Some(0.0)));
    }
}
