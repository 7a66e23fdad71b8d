//! The serial ports of this machine: what is plugged in, under which lasting name, who may open it and who has it open.
//!
//! Linux only: everything is read from `/sys/class/tty`, `/dev/serial`, `/etc/group` and `/proc`; nothing is opened.

pub mod access;
pub mod holder;

use std::fs;
use std::path::{Path, PathBuf};

use access::Access;
use holder::Holder;

/// A serial port that is there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Port {
    /// Its path now, such as `/dev/ttyUSB0`: the number is the order of plugging, not the device's.
    pub path: PathBuf,
    /// Links to it that last over re-plugging and reboots, the best first: by the adapter's serial number
    /// (`/dev/serial/by-id`), then by the socket it is plugged into (`/dev/serial/by-path`).
    pub links: Vec<PathBuf>,
    /// Who made the adapter; `None` where it is not on USB.
    pub usb: Option<Usb>,
    /// The kernel's driver, such as `ftdi_sio`; empty when it says none.
    pub driver: String,
    /// Whether this user may open it.
    pub access: Access,
    /// Programs that have it open, as far as this user may see them.
    pub holders: Vec<Holder>,
}

/// What a USB device says about itself.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Usb {
    /// Vendor id.
    pub vendor_id: u16,
    /// Product id.
    pub product_id: u16,
    /// Maker; empty when it says none.
    pub manufacturer: String,
    /// Product; empty when it says none.
    pub product: String,
    /// Serial number; empty when it has none, and then two of a kind cannot be told apart but by their sockets.
    pub serial: String,
}

impl Usb {
    /// What is often behind such an adapter; `None` where nothing is known.
    #[must_use]
    pub const fn hint(&self) -> Option<&'static str> {
        match (self.vendor_id, self.product_id) {
            (0x10c4, 0xea60) | (0x1a86, 0x7523 | 0x55d4) => {
                Some("ESP32 or Arduino board: often a LucidGlove")
            }
            (0x2341 | 0x2a03, _) => Some("Arduino"),
            (0x0f44, _) => Some("Polhemus"),
            (0x0403, _) => Some("FTDI adapter"),
            (0x067b, _) => Some("Prolific adapter"),
            _ => None,
        }
    }
}

impl Port {
    /// The name to put into settings: the best lasting one, or the path where there is none.
    #[must_use]
    pub fn lasting_name(&self) -> &Path {
        self.links.first().unwrap_or(&self.path)
    }
}

/// Whether a path is numbered by the order of plugging, so that it may be another device tomorrow.
#[must_use]
pub fn is_numbered(path: &str) -> bool {
    ["/dev/ttyUSB", "/dev/ttyACM"]
        .iter()
        .filter_map(|stem| path.strip_prefix(stem))
        .any(|rest| !rest.is_empty() && rest.bytes().all(|byte| byte.is_ascii_digit()))
}

/// Every serial port, by path.
#[must_use]
pub fn list() -> Vec<Port> {
    list_in(Path::new("/"))
}

/// The port that a path, or a link, leads to; `None` when it leads to no serial port of hardware.
#[must_use]
pub fn find(path: &Path) -> Option<Port> {
    let target = fs::canonicalize(path).ok()?;
    list().into_iter().find(|port| port.path == target)
}

/// The same with another root, for tests.
fn list_in(root: &Path) -> Vec<Port> {
    let links = lasting_links(root);
    let mut names: Vec<String> = entries(&root.join("sys/class/tty"))
        .into_iter()
        .filter_map(|entry| Some(entry.file_name()?.to_str()?.to_owned()))
        .filter(|name| is_hardware(root, name))
        .collect();
    names.sort_by_key(|name| (name.len(), name.clone()));
    names
        .into_iter()
        .map(|name| port(root, &name, &links))
        .collect()
}

fn port(root: &Path, name: &str, links: &[(PathBuf, PathBuf)]) -> Port {
    let path = Path::new("/dev").join(name);
    let device = root.join("sys/class/tty").join(name).join("device");
    let driver = fs::read_link(device.join("driver"))
        .ok()
        .and_then(|link| Some(link.file_name()?.to_str()?.to_owned()));
    let of_this = links.iter().filter(|(_, target)| *target == path);
    Port {
        links: of_this.map(|(link, _)| link.clone()).collect(),
        usb: usb(&device),
        driver: driver.unwrap_or_default(),
        access: Access::of(&root.join("dev").join(name)),
        holders: holder::holders(&root.join("proc"), &path),
        path,
    }
}

/// USB and Bluetooth ports, and those of the board that have a chip behind them: the kernel lists sockets without one too.
fn is_hardware(root: &Path, name: &str) -> bool {
    let tty = root.join("sys/class/tty").join(name);
    if name.starts_with("rfcomm") {
        return true;
    }
    let is_empty_socket = fs::read_to_string(tty.join("type")).is_ok_and(|kind| kind.trim() == "0");
    tty.join("device").exists() && !is_empty_socket
}

/// The first directory above a port's device that is a USB device.
fn usb(device: &Path) -> Option<Usb> {
    let device = fs::canonicalize(device).ok()?;
    let of_usb = device
        .ancestors()
        .find(|folder| folder.join("idVendor").is_file())?;
    let text = |name: &str| {
        fs::read_to_string(of_usb.join(name))
            .map_or_else(|_| String::new(), |text| text.trim().to_owned())
    };
    let number = |name: &str| u16::from_str_radix(&text(name), 16).unwrap_or(0);
    Some(Usb {
        vendor_id: number("idVendor"),
        product_id: number("idProduct"),
        manufacturer: text("manufacturer"),
        product: text("product"),
        serial: text("serial"),
    })
}

/// Links with the ports they lead to, those by serial number first.
fn lasting_links(root: &Path) -> Vec<(PathBuf, PathBuf)> {
    let mut links = Vec::new();
    for folder in ["dev/serial/by-id", "dev/serial/by-path"] {
        let mut here = entries(&root.join(folder));
        here.sort();
        for link in here {
            let target = fs::read_link(&link).ok();
            let name = target.as_deref().and_then(Path::file_name);
            if let (Some(name), Ok(inside)) = (name, link.strip_prefix(root)) {
                links.push((Path::new("/").join(inside), Path::new("/dev").join(name)));
            }
        }
    }
    links
}

/// What is in a folder; nothing when there is none.
fn entries(folder: &Path) -> Vec<PathBuf> {
    fs::read_dir(folder).map_or_else(
        |_| Vec::new(),
        |entries| entries.flatten().map(|entry| entry.path()).collect(),
    )
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::{Usb, fs, is_numbered, list_in};

    #[test]
    fn the_order_of_plugging_is_no_name() {
        for (path, expected) in [
            ("/dev/ttyUSB0", true),
            ("/dev/ttyACM12", true),
            ("/dev/ttyUSB", false),
            ("/dev/ttyUSBglove", false),
            ("/dev/ttyS0", false),
            ("/dev/rfcomm0", false),
            ("/dev/serial/by-id/usb-1", false),
        ] {
            assert_eq!(is_numbered(path), expected, "{path}");
        }
    }

    #[test]
    fn a_port_is_told_with_its_maker_and_its_lasting_names() {
        let root = std::env::temp_dir().join(format!("tsukamu-ports-{}", std::process::id()));
        let usb = root.join("sys/devices/usb1/1-2");
        let tty = usb.join("1-2:1.0/ttyUSB0");
        let class = root.join("sys/class/tty");
        for folder in [
            &tty,
            &class.join("ttyUSB0"),
            &class.join("ttyS0/device"),
            &class.join("tty0"),
            &root.join("sys/drivers/ftdi_sio"),
            &root.join("dev/serial/by-id"),
            &root.join("dev/serial/by-path"),
        ] {
            fs::create_dir_all(folder).unwrap();
        }
        symlink(&tty, class.join("ttyUSB0/device")).unwrap();
        symlink(root.join("sys/drivers/ftdi_sio"), tty.join("driver")).unwrap();
        fs::write(class.join("ttyS0/type"), "0\n").unwrap();
        for (name, text) in [
            ("idVendor", "0403\n"),
            ("idProduct", "6001\n"),
            ("manufacturer", "FTDI\n"),
            ("serial", "A100\n"),
        ] {
            fs::write(usb.join(name), text).unwrap();
        }
        symlink("../../ttyUSB0", root.join("dev/serial/by-path/pci-1")).unwrap();
        symlink("../../ttyUSB0", root.join("dev/serial/by-id/usb-FTDI_A100")).unwrap();
        let ports = list_in(&root);
        fs::remove_dir_all(&root).unwrap();
        assert_eq!(
            ports.len(),
            1,
            "an empty socket and a console are none: {ports:?}"
        );
        let port = &ports[0];
        assert_eq!(port.path.to_str(), Some("/dev/ttyUSB0"));
        assert_eq!(port.driver, "ftdi_sio");
        assert_eq!(
            port.lasting_name().to_str(),
            Some("/dev/serial/by-id/usb-FTDI_A100")
        );
        assert_eq!(port.links.len(), 2);
        let expected = Usb {
            vendor_id: 0x0403,
            product_id: 0x6001,
            manufacturer: "FTDI".to_owned(),
            product: String::new(),
            serial: "A100".to_owned(),
        };
        assert_eq!(port.usb.as_ref(), Some(&expected));
        assert_eq!(expected.hint(), Some("FTDI adapter"));
    }
}
