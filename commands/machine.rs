//! What the machine has: processors, free memory, and what this process took of them.

use cpu_time::ProcessTime;
use std::fs;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

/// Worker threads: as asked, or with 0 all that this process may use.
///
/// A batch system that grants fewer processors than the machine shows says so in
/// `SLURM_CPUS_PER_TASK`.
pub fn threads(asked: u16) -> usize {
    if asked > 0 {
        return usize::from(asked);
    }
    let here = thread::available_parallelism().map_or(1, usize::from);
    let granted = std::env::var("SLURM_CPUS_PER_TASK")
        .ok()
        .and_then(|text| text.parse().ok())
        .filter(|granted| *granted > 0);
    granted.map_or(here, |granted: usize| granted.min(here))
}

/// Bytes this process may use unless told otherwise: 80 % of what is free, no limit where the
/// system does not tell.
pub fn default_memory() -> u64 {
    free_memory().map_or(u64::MAX, |free| free / 5 * 4)
}

/// Bytes that are free to this process: of the machine, and of the control groups it runs in.
fn free_memory() -> Option<u64> {
    let machine = fs::read_to_string("/proc/meminfo")
        .ok()
        .and_then(|text| kibibytes(&text, "MemAvailable:"));
    let root = Path::new("/sys/fs/cgroup");
    let own = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let own = own.lines().find_map(|line| line.strip_prefix("0::/"));
    let folder = root.join(own.unwrap_or_default());
    let groups = folder
        .ancestors()
        .take_while(|folder| folder.starts_with(root))
        .filter_map(free_in_group);
    groups.chain(machine).min()
}

/// What a control group (version 2) may still take. Its file cache counts as free: the kernel
/// gives it up first.
fn free_in_group(folder: &Path) -> Option<u64> {
    let text = |name| fs::read_to_string(folder.join(name)).ok();
    let number = |name| text(name)?.trim().parse::<u64>().ok();
    let (most, used) = (number("memory.max")?, number("memory.current")?);
    let cache = text("memory.stat")
        .and_then(|stat| {
            let line = stat.lines().find_map(|l| l.strip_prefix("inactive_file "));
            line?.parse().ok()
        })
        .unwrap_or(0);
    Some(most.saturating_sub(used.saturating_sub(cache)))
}

/// The largest resident memory of this process so far, in bytes, where the system tells.
pub fn peak_bytes() -> Option<u64> {
    kibibytes(&fs::read_to_string("/proc/self/status").ok()?, "VmHWM:")
}

/// Starts the largest resident memory anew from what is resident now; tells whether that was done.
pub fn forget_peak() -> bool {
    fs::write("/proc/self/clear_refs", "5").is_ok()
}

/// The bytes of a line `key    123 kB`.
fn kibibytes(text: &str, key: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    let number: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    number.checked_mul(1024)
}

/// A moment, by the clock on the wall and by processor time of all threads.
#[derive(Debug, Clone, Copy)]
pub struct Moment {
    wall: Instant,
    cpu: ProcessTime,
}

impl Moment {
    /// This moment.
    pub fn now() -> Self {
        Moment {
            wall: Instant::now(),
            cpu: ProcessTime::now(),
        }
    }

    /// Wall and processor seconds from an earlier moment to this one.
    pub fn since(&self, earlier: &Moment) -> (f64, f64) {
        let wall = self.wall.duration_since(earlier.wall);
        let cpu = self.cpu.duration_since(earlier.cpu);
        (Duration::as_secs_f64(&wall), Duration::as_secs_f64(&cpu))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_given_is_the_number_of_threads() {
        assert_eq!(threads(3), 3);
        assert!(threads(0) >= 1);
    }

    #[test]
    fn the_kernel_tables_are_read() {
        let text = "MemFree:  9 kB\nMemAvailable:   12 kB\nodd: 7\n";
        assert_eq!(kibibytes(text, "MemAvailable:"), Some(12 * 1024));
        assert_eq!(kibibytes(text, "odd:"), None);
        assert_eq!(kibibytes(text, "absent:"), None);
        let endless = format!("VmHWM: {} kB", u64::MAX);
        assert_eq!(kibibytes(&endless, "VmHWM:"), None);
    }
}
