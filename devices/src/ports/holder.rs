//! Who has a port open.

use std::fs;
use std::path::Path;

/// A program that has a port open.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Holder {
    /// Its process id.
    pub pid: u32,
    /// Its name, as the kernel has it: 15 characters at most.
    pub name: String,
}

/// Programs that have `device` (no link) open, by process id. Those of other users stay unseen without their rights.
#[must_use]
pub fn holders(proc: &Path, device: &Path) -> Vec<Holder> {
    let pids = fs::read_dir(proc)
        .into_iter()
        .flatten()
        .flatten()
        .filter_map(|entry| entry.file_name().to_str()?.parse::<u32>().ok());
    let mut holders: Vec<Holder> = pids
        .filter(|pid| holds(&proc.join(pid.to_string()).join("fd"), device))
        .map(|pid| {
            let name = fs::read_to_string(proc.join(pid.to_string()).join("comm"));
            Holder {
                pid,
                name: name.unwrap_or_default().trim().to_owned(),
            }
        })
        .collect();
    holders.sort_by_key(|holder| holder.pid);
    holders
}

fn holds(descriptors: &Path, device: &Path) -> bool {
    fs::read_dir(descriptors)
        .into_iter()
        .flatten()
        .flatten()
        .any(|entry| fs::read_link(entry.path()).is_ok_and(|target| target == device))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::holders;

    #[test]
    fn a_program_that_has_it_open_is_found() {
        let path = std::env::temp_dir().join(format!("tsukamu-held-{}", std::process::id()));
        let file = std::fs::File::create(&path).unwrap();
        let path = std::fs::canonicalize(&path).unwrap();
        let held = holders(Path::new("/proc"), &path);
        drop(file);
        let left = holders(Path::new("/proc"), &path);
        std::fs::remove_file(&path).unwrap();
        assert_eq!(held.len(), 1, "{held:?}");
        assert_eq!(held[0].pid, std::process::id());
        assert!(!held[0].name.is_empty());
        assert_eq!(left, []);
    }
}
