//! A log with a reader that behaves like real readers.

use std::sync::mpsc::{Receiver, Sender, channel};

use super::*;

/// A writer that asks the test before each write: it accepts what the test decides, or fails.
struct Puppet {
    asks: Sender<Vec<u8>>,
    answers: Receiver<io::Result<usize>>,
}

impl Write for Puppet {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let gone = |_| io::Error::from(ErrorKind::BrokenPipe);
        self.asks.send(bytes.to_vec()).map_err(|_| io::Error::from(ErrorKind::BrokenPipe))?;
        self.answers.recv().map_err(gone)?
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

struct Bench {
    log: Log,
    writes: Receiver<Vec<u8>>,
    answers: Sender<io::Result<usize>>,
}

impl Bench {
    fn new() -> Self {
        Self::with(false)
    }

    /// Makes a log that the journal reads.
    fn of_journal() -> Self {
        Self::with(true)
    }

    fn with(is_journal: bool) -> Self {
        let ((asks, writes), (answers, wants)) = (channel(), channel());
        Self { log: Log::to(Puppet { asks, answers: wants }, is_journal).unwrap(), writes, answers }
    }

    fn log(&self, text: &str) {
        self.log.make_writer().write_all(text.as_bytes()).unwrap();
    }

    /// Returns the next write, and accepts all of it.
    fn take(&self) -> String {
        let bytes = self.writes.recv().unwrap();
        self.answers.send(Ok(bytes.len())).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    fn lost(&self) -> u64 {
        self.log.0.lock().lost
    }
}

#[test]
fn lines_come_whole_and_in_order() {
    let bench = Bench::new();
    bench.log("one\n");
    let mut all = bench.take();
    bench.log("two\n");
    bench.log.say("three");
    while all.len() < "one\ntwo\nthree\n".len() {
        all += &bench.take();
    }
    assert_eq!(all, "one\ntwo\nthree\n");
    assert!(bench.log.flush(Duration::from_secs(60)));
}

#[test]
fn a_reader_that_reads_nothing_costs_bounded_memory_and_learns_what_it_missed() {
    let bench = Bench::new();
    bench.log("the first\n");
    let first = bench.writes.recv().unwrap();
    let line = format!("{}\n", "x".repeat(999));
    for _ in 0..10_000 {
        bench.log(&line);
    }
    let held = bench.log.0.lock().waiting.len();
    assert!(held <= CAPACITY, "{held} bytes");
    assert_eq!(bench.lost(), 10_000 - (held / line.len()) as u64);
    assert!(!bench.log.flush(Duration::ZERO), "and no caller waits for it");
    // There is room for the last sentence of a process.
    bench.log.say("simd: the end");
    bench.answers.send(Ok(first.len())).unwrap();
    let rest = bench.take();
    let notice = format!("could not be written since the start: {}\n", bench.lost());
    assert!(rest.ends_with(&format!("{notice}simd: the end\n")), "{}", &rest[rest.len() - 200..]);
}

#[test]
fn unwritten_lines_are_counted_and_reported_later() {
    let bench = Bench::new();
    bench.log("lost\n");
    bench.writes.recv().unwrap();
    bench.answers.send(Err(ErrorKind::StorageFull.into())).unwrap();
    assert!(bench.log.flush(Duration::from_secs(60)), "what cannot be written does not wait");
    // Half of the next line is written.
    bench.log("half\n");
    let tried = String::from_utf8(bench.writes.recv().unwrap()).unwrap();
    assert!(tried.contains("since the start: 1\n"), "{tried}");
    bench.answers.send(Ok(tried.len() - 3)).unwrap();
    bench.writes.recv().unwrap();
    bench.answers.send(Err(ErrorKind::StorageFull.into())).unwrap();
    assert!(bench.log.flush(Duration::from_secs(60)));
    bench.log("whole\n");
    let all = bench.take();
    assert!(all.starts_with('\n'), "a new line is begun: {all:?}");
    assert!(all.contains("since the start: 2\n") && all.ends_with("\nwhole\n"), "{all:?}");
}

#[test]
fn a_loss_is_reported_without_another_line() {
    let bench = Bench::new();
    bench.log("the first\n");
    let first = bench.writes.recv().unwrap();
    let line = format!("{}\n", "x".repeat(CAPACITY));
    bench.log(&line);
    bench.answers.send(Ok(first.len())).unwrap();
    assert!(bench.take().ends_with("since the start: 1\n"));
}

#[test]
fn a_reader_that_is_gone_makes_no_writer_fail() {
    let Bench { log, writes, answers } = Bench::new();
    drop((writes, answers));
    for _ in 0..100 {
        log.make_writer().write_all(b"a line without a reader\n").unwrap();
    }
    assert!(log.flush(Duration::from_secs(60)));
    // Notices of the loss, between two lines, are lost too.
    let lost = log.0.lock().lost;
    assert!((100..200).contains(&lost), "{lost}");
}

#[test]
fn invisible_characters_are_written_out() {
    let bench = Bench::new();
    bench.log("joint `a\u{202e}b\u{200b}` of `épaule`\n");
    assert_eq!(bench.take(), "joint `a\\u{202e}b\\u{200b}` of `épaule`\n");
}

#[test]
fn lines_for_programs_are_objects_whatever_says_them() {
    let bench = Bench::new();
    bench.log.set_format(LogFormat::Json);
    bench.log.say("simd: \"it\" ends");
    let line: serde_json::Value = serde_json::from_str(&bench.take()).unwrap();
    assert_eq!(line["fields"]["message"], "simd: \"it\" ends");
    assert_eq!((&line["level"], line["timestamp"].is_string()), (&"ERROR".into(), true));
    // The report of lost lines is JSON too.
    bench.log.0.lock().lost = 7;
    bench.log("{}\n");
    let lines = bench.take();
    let notice: serde_json::Value = serde_json::from_str(lines.lines().next().unwrap()).unwrap();
    assert_eq!(notice["level"], "WARN");
}

/// Returns one event of each level, as text or JSON, without the priority and with it.
fn of_each_level(bench: &Bench, format: LogFormat) -> Vec<String> {
    bench.log.set_format(format);
    let lines = tracing_subscriber::fmt().with_writer(bench.log.clone()).with_max_level(Level::TRACE);
    let events = || {
        tracing::error!("an error");
        tracing::warn!("a warning");
        tracing::info!("for people");
        tracing::debug!("for whom it concerns");
        tracing::trace!("all of it");
    };
    match format {
        LogFormat::Text => tracing::subscriber::with_default(lines.with_ansi(false).finish(), events),
        LogFormat::Json => tracing::subscriber::with_default(lines.json().finish(), events),
    }
    let mut all = String::new();
    while all.lines().count() < 5 {
        all += &bench.take();
    }
    all.lines().map(str::to_owned).collect()
}

#[test]
fn the_journal_gets_the_priority_of_each_line_and_no_other_reader_does() {
    for format in [LogFormat::Text, LogFormat::Json] {
        let lines = of_each_level(&Bench::of_journal(), format);
        for (line, (prefix, level)) in lines.iter().zip([
            ("<3>", "ERROR"),
            ("<4>", "WARN"),
            ("<6>", "INFO"),
            ("<7>", "DEBUG"),
            ("<7>", "TRACE"),
        ]) {
            let rest = line.strip_prefix(prefix).unwrap_or_else(|| panic!("{prefix}: {line}"));
            assert!(rest.contains(level), "{line}");
            assert_eq!(rest.starts_with('{'), format == LogFormat::Json, "{line}");
        }
        let lines = of_each_level(&Bench::new(), format);
        assert!(lines.iter().all(|line| !line.starts_with('<')), "{lines:?}");
    }
}

#[test]
fn each_line_of_a_message_has_the_priority_whatever_the_message_says() {
    let bench = Bench::of_journal();
    bench.log("robot `a\n<0>b`\n");
    assert_eq!(bench.take(), "<6>robot `a\n<6><0>b`\n");
    bench.log.say("thread `a` panicked\n  at b");
    assert_eq!(bench.take(), "<3>thread `a` panicked\n<3>  at b\n");
    // The report of lost lines is a warning.
    assert!(bench.log.flush(Duration::from_secs(60)));
    bench.log.0.lock().lost = 7;
    bench.log("the next\n");
    let lines = bench.take();
    let (notice, next) = lines.split_once('\n').unwrap();
    assert!(notice.starts_with("<4>") && notice.ends_with(": 7") && next == "<6>the next\n", "{lines:?}");
}
