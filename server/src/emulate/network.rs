//! Emulated senders of hands over the network.

use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use tsukamu_devices::emulate::source::{SentHand, SourceEmulator, SourceKind};
use tsukamu_devices::emulate::udp::UdpEmulator;
use tsukamu_devices::place::Place;

use super::wearing::{joint_angles_of, sensor_angles};
use super::{Played, Plugged, TrackerPlace, Worn};

/// A sender of datagrams; pulling its cable is silence.
#[derive(Debug)]
pub struct Sender {
    emulator: UdpEmulator<SourceEmulator>,
    /// The daemon's place for it.
    place: PathBuf,
}

/// What sends that hand's bones by the VMC protocol.
///
/// # Errors
/// When the address has no host, or the system no socket or thread to give.
pub fn spawn_vmc(worn: Worn) -> io::Result<Sender> {
    let to = worn
        .to
        .unwrap_or_else(|| usual(tsukamu_devices::source::vmc::USUAL_PORT));
    spawn(SourceKind::Vmc, worn.played, worn.place, &to)
}

/// What sends that hand's joints as Rokoko Studio does.
///
/// # Errors
/// When the address has no host, or the system no socket or thread to give.
pub fn spawn_rokoko(worn: Worn) -> io::Result<Sender> {
    let kind = match worn.model {
        "lz4" => SourceKind::RokokoLz4,
        _ => SourceKind::Rokoko,
    };
    let to = worn
        .to
        .unwrap_or_else(|| usual(tsukamu_devices::source::rokoko::USUAL_PORT));
    spawn(kind, worn.played, worn.place, &to)
}

/// What sends that hand's angles as the bridge of UDCAP gloves does.
///
/// # Errors
/// When the address has no host, or the system no socket or thread to give.
pub fn spawn_udcap(worn: Worn) -> io::Result<Sender> {
    let to = worn
        .to
        .unwrap_or_else(|| usual(tsukamu_devices::source::udcap::USUAL_PORT));
    spawn(SourceKind::Udcap, worn.played, worn.place, &to)
}

fn usual(port: u16) -> String {
    format!("127.0.0.1:{port}")
}

fn spawn(kind: SourceKind, played: Played, place: TrackerPlace, to: &str) -> io::Result<Sender> {
    let side = played.motion.side();
    let hand = played.handedness();
    let emulator = UdpEmulator::spawn(
        SourceEmulator::new(kind),
        to,
        move |now_ns, emulator: &mut SourceEmulator| {
            let sent = played.sample_at(now_ns).and_then(|sample| {
                let sender_from_wrist = place.world_from_transmitter.inverse() * sample.wrist;
                Some(SentHand {
                    angles: sensor_angles(&joint_angles_of(&sample, side)?),
                    world_from_wrist: sender_from_wrist * place.wrist_from_sensor,
                })
            });
            emulator.set_hand(hand, sent);
        },
    )?;
    let place = Place::Udp(emulator.to()).to_string();
    Ok(Sender {
        emulator,
        place: PathBuf::from(place),
    })
}

impl Plugged for Sender {
    fn path(&self) -> &Path {
        &self.place
    }

    fn unplug(&mut self) {
        self.emulator.set_unplugged(true);
    }

    fn plug(&mut self) -> io::Result<()> {
        self.emulator.set_unplugged(false);
        Ok(())
    }

    fn spoil(&mut self, share: f64) {
        self.emulator.spoil(share);
    }

    fn stall(&mut self, time: Duration) {
        self.emulator.stall(time);
    }

    fn cut_power(&mut self, time: Duration) {
        self.emulator.restart(time);
    }
}
