//! Who may open a port.

use std::fs;
use std::io::ErrorKind;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use nix::unistd::{AccessFlags, access};

/// Whether this user may read and write a port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Access {
    /// Yes.
    Granted,
    /// No.
    Denied {
        /// Name of the group that owns the port, or its number when it has no name.
        group: String,
        /// Whether that group may read and write it.
        group_may: bool,
    },
    /// It is not there.
    Missing,
}

impl Access {
    /// Of a port, or a link to it.
    #[must_use]
    pub fn of(path: &Path) -> Self {
        let metadata = match fs::metadata(path) {
            Ok(metadata) => metadata,
            Err(fault) if fault.kind() == ErrorKind::PermissionDenied => {
                return Self::Denied {
                    group: String::new(),
                    group_may: false,
                };
            }
            Err(_) => return Self::Missing,
        };
        if access(path, AccessFlags::R_OK | AccessFlags::W_OK).is_ok() {
            return Self::Granted;
        }
        let groups = fs::read_to_string("/etc/group").unwrap_or_default();
        Self::Denied {
            group: group_name(&groups, metadata.gid()),
            group_may: metadata.mode() & 0o060 == 0o060,
        }
    }

    /// What to do about it, as a command where there is one; `None` where nothing is to be done.
    #[must_use]
    pub fn remedy(&self) -> Option<String> {
        match self {
            Self::Granted | Self::Missing => None,
            Self::Denied {
                group,
                group_may: true,
            } if group != "root" => Some(format!(
                "sudo usermod -aG {group} \"$USER\", then log out and in again (`newgrp {group}` for this terminal alone)"
            )),
            Self::Denied { .. } => Some(
                "install the udev rules of `deploy/60-tsukamu.rules`, then sudo udevadm control --reload && sudo udevadm trigger"
                    .to_owned(),
            ),
        }
    }
}

/// A group's name in the text of `/etc/group`.
fn group_name(groups: &str, gid: u32) -> String {
    let number = gid.to_string();
    groups
        .lines()
        .find_map(|line| {
            let mut fields = line.split(':');
            let name = fields.next()?;
            (fields.nth(1) == Some(number.as_str())).then(|| name.to_owned())
        })
        .unwrap_or(number)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{Access, group_name};

    #[test]
    fn a_group_is_told_by_name() {
        let groups = "root:x:0:\ndialout:x:20:alice\nbroken\n";
        assert_eq!(group_name(groups, 20), "dialout");
        assert_eq!(group_name(groups, 21), "21");
    }

    #[test]
    fn each_refusal_has_a_remedy() {
        let denied = |group: &str, group_may| Access::Denied {
            group: group.to_owned(),
            group_may,
        };
        let remedy = denied("dialout", true).remedy().unwrap();
        assert!(remedy.contains("usermod -aG dialout"), "{remedy}");
        for access in [denied("dialout", false), denied("root", true)] {
            let remedy = access.remedy().unwrap();
            assert!(remedy.contains("udev"), "{remedy}");
        }
        assert_eq!(Access::of(Path::new("/dev/null")), Access::Granted);
        assert_eq!(Access::of(Path::new("/dev/not there")), Access::Missing);
    }
}
