//! Properties of the kernel that decide how late it wakes a thread, whatever the thread's priority: the log
//! of a run records them.

/// Returns the kernel's version and its preemption setting.
pub fn kernel() -> String {
    described(|file| std::fs::read_to_string(file).ok())
}

fn described(read: impl Fn(&str) -> Option<String>) -> String {
    let [release, version] = ["osrelease", "version"].map(|name| {
        let text = read(&format!("/proc/sys/kernel/{name}"));
        text.map_or_else(|| "unknown".to_owned(), |text| text.trim().to_owned())
    });
    let line = read("/proc/cmdline").unwrap_or_default();
    let preempts = line.split_whitespace().find(|word| word.starts_with("preempt=")).unwrap_or_default();
    format!("Linux {release} {version} {preempts}").trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn properties_that_the_kernel_does_not_report_are_unknown() {
        let read = |file: &str| {
            let text = match file {
                "/proc/sys/kernel/osrelease" => "6.1.0-13\n",
                "/proc/cmdline" => "root=/dev/vda1 preempt=full quiet\n",
                _ => return None,
            };
            Some(text.to_owned())
        };
        assert_eq!(described(read), "Linux 6.1.0-13 unknown preempt=full");
        assert_eq!(described(|_| None), "Linux unknown unknown");
    }
}
