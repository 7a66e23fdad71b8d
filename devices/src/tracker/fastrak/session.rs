//! The Fastrak's start-up, silence and recovery.
//!
//! ```text
//!  Closed -> Resetting (c, then ever stronger) -> Asking (S) -> Configuring (u O l f … S) -> Running (C)
//!               ^                                  | silent          | refused                 | silence
//!               +----------------------------------+-----------------+-------------------------+
//! ```

use crate::core::Core;
use crate::fault::{Fault, hex};
use crate::reading::TrackerReading;
use crate::session::{DeviceEvent, DeviceInfo, PortRequest, Session, SessionState, SessionStats};
use crate::tracker::fastrak::decode::{Encoding, Item, LengthUnit, RecordFormat, Sample};
use crate::tracker::fastrak::framer::{Framer, Piece};
use crate::tracker::fastrak::protocol::{
    ATTEMPTS, CONTINUOUS, FAMILY, MAX_BAD_BYTES, N_STATIONS, QUIET, RESETS, SILENCE_NS, STATUS,
    STATUS_NS, data_usable,
};
use crate::tracker::fastrak::settings::{FastrakSettings, commands};
use crate::tracker::fastrak::status::{ControlRecord, StatusRecord};
use crate::tracker::space::TrackerSpace;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Closed,
    /// A reset was sent; input is thrown away.
    Resetting {
        attempt: usize,
    },
    /// `S` was sent.
    Asking {
        attempt: usize,
    },
    /// The settings and another `S` were sent.
    Configuring {
        attempt: u32,
    },
    Running,
}

/// A Fastrak as a state machine. **Emulated, not yet tried on hardware.**
#[derive(Debug)]
pub struct FastrakSession {
    settings: FastrakSettings,
    core: Core,
    framer: Framer,
    format: RecordFormat,
    stage: Stage,
    deadline_ns: Option<u64>,
    sequences: [u64; N_STATIONS],
    bad_bytes: u64,
    /// Openings of the port since the unit last answered.
    silent_openings: usize,
    first_bytes: Vec<u8>,
}

impl FastrakSession {
    /// A session for a port that is not open yet.
    #[must_use]
    pub fn new(settings: FastrakSettings) -> Self {
        let trailer = match settings.encoding {
            Encoding::Ascii => Item::CrLf,
            Encoding::Binary => Item::Space,
        };
        let format = RecordFormat {
            items: vec![Item::Position, Item::Quaternion, trailer],
            encoding: settings.encoding,
            unit: LengthUnit::Centimetres,
        };
        Self {
            settings,
            core: Core::new(),
            framer: Framer::default(),
            format,
            stage: Stage::Closed,
            deadline_ns: None,
            sequences: [0; N_STATIONS],
            bad_bytes: 0,
            silent_openings: 0,
            first_bytes: Vec::new(),
        }
    }

    fn reset(&mut self, now_ns: u64, attempt: usize) {
        let (bytes, wait_ns) = RESETS[attempt.min(RESETS.len() - 1)];
        self.core.send(bytes);
        self.framer.clear();
        self.stage = Stage::Resetting { attempt };
        self.deadline_ns = Some(now_ns + wait_ns);
        self.core
            .enter(now_ns, SessionState::Resetting, self.core.fault.clone());
    }

    fn ask(&mut self, now_ns: u64, attempt: usize) {
        self.core.send([STATUS]);
        self.framer.clear();
        self.stage = Stage::Asking { attempt };
        self.deadline_ns = Some(now_ns + STATUS_NS);
        self.core
            .enter(now_ns, SessionState::Querying, self.core.fault.clone());
    }

    fn configure(&mut self, now_ns: u64, attempt: u32) {
        for command in commands(&self.settings, &self.format.items) {
            self.core.send(command);
        }
        self.core.send([STATUS]);
        self.stage = Stage::Configuring { attempt };
        self.deadline_ns = Some(now_ns + STATUS_NS);
    }

    fn run(&mut self, now_ns: u64) {
        self.core.send([CONTINUOUS]);
        self.framer.clear();
        self.bad_bytes = 0;
        self.stage = Stage::Running;
        self.deadline_ns = Some(now_ns + SILENCE_NS);
    }

    fn take_status(&mut self, now_ns: u64, status: &StatusRecord) {
        self.silent_openings = 0;
        match self.stage {
            Stage::Asking { .. } => {
                self.core.emit(DeviceEvent::Identified(DeviceInfo {
                    family: FAMILY,
                    firmware: status.firmware.clone(),
                    identity: status.identity.clone(),
                    n_sensors: self.settings.stations.iter().filter(|used| **used).count(),
                    hand: None,
                    tick_ns: None,
                }));
                self.configure(now_ns, 0);
            }
            Stage::Configuring { attempt } => {
                let binary = self.settings.encoding == Encoding::Binary;
                if status.binary() == binary && status.centimetres() {
                    self.run(now_ns);
                } else if attempt + 1 < ATTEMPTS {
                    self.configure(now_ns, attempt + 1);
                } else {
                    let setting = if status.centimetres() {
                        "binary or ASCII"
                    } else {
                        "centimetres"
                    };
                    let fault = Fault::Refused {
                        device: FAMILY,
                        setting: setting.to_owned(),
                    };
                    self.core.enter(now_ns, SessionState::Stalled, Some(fault));
                    self.reset(now_ns, 1);
                }
            }
            Stage::Closed | Stage::Resetting { .. } | Stage::Running => {}
        }
    }

    fn take_piece(&mut self, now_ns: u64, piece: Piece) {
        match piece {
            Piece::Data { stamp_ns, sample } if self.stage == Stage::Running => {
                self.accept(stamp_ns, &sample);
            }
            Piece::Data { .. } | Piece::Control(ControlRecord::Other) => {}
            Piece::Control(ControlRecord::Status(status)) => self.take_status(now_ns, &status),
            Piece::Control(ControlRecord::Refusal(code)) => {
                self.core.stats.device_errors += 1;
                let fault = Fault::Reported {
                    device: FAMILY,
                    code,
                    meaning: "command refused",
                };
                self.core.enter(now_ns, self.core.state, Some(fault));
            }
            Piece::Skipped { n_bytes, lost_step } => {
                if self.stage == Stage::Running {
                    self.reject(now_ns, n_bytes, lost_step);
                }
            }
        }
    }

    fn accept(&mut self, stamp_ns: u64, sample: &Sample) {
        self.core.stats.records += 1;
        self.bad_bytes = 0;
        self.deadline_ns = Some(stamp_ns + SILENCE_NS);
        self.core.enter(stamp_ns, SessionState::Running, None);
        if let Some(letter) = sample.error {
            self.core.stats.device_errors += u64::from(!data_usable(letter));
        }
        let usable = sample.error.is_none_or(data_usable);
        let sequence = &mut self.sequences[usize::from(sample.station) - 1];
        self.core.emit(DeviceEvent::Tracker(TrackerReading {
            space: TrackerSpace::ZDown,
            device_ticks: None,
            stamp_ns,
            sequence: *sequence,
            station: sample.station.into(),
            position: sample.position,
            rotation: sample.rotation,
            position_valid: usable && sample.position.is_some(),
            rotation_valid: usable && sample.rotation.is_some(),
            error: sample.error.map(char::from),
            stylus_pressed: sample.stylus_pressed,
        }));
        *sequence += 1;
    }

    fn reject(&mut self, now_ns: u64, n_bytes: u64, lost_step: bool) {
        self.core.stats.resyncs += u64::from(lost_step);
        self.core.stats.dropped_records += u64::from(lost_step);
        self.bad_bytes += n_bytes;
        if self.bad_bytes > MAX_BAD_BYTES {
            let fault = Fault::Garbled {
                device: FAMILY,
                first_bytes: hex(&self.first_bytes),
            };
            self.stall(now_ns, fault);
        }
    }

    fn stall(&mut self, now_ns: u64, fault: Fault) {
        self.core.enter(now_ns, SessionState::Stalled, Some(fault));
        self.core.stats.restarts += 1;
        self.first_bytes.clear();
        self.bad_bytes = 0;
        self.reset(now_ns, 0);
    }

    /// No status came: a stronger reset, or the port again; the more openings were silent, the stronger it gets.
    fn no_answer(&mut self, now_ns: u64, attempt: usize) {
        let fault = if self.first_bytes.is_empty() {
            Fault::Silent { device: FAMILY }
        } else {
            Fault::NotThisDevice {
                device: FAMILY,
                first_bytes: hex(&self.first_bytes),
            }
        };
        self.core.stats.restarts += 1;
        self.core.enter(now_ns, SessionState::Stalled, Some(fault));
        let strongest = (1 + self.silent_openings).min(RESETS.len() - 1);
        if attempt < strongest {
            self.reset(now_ns, attempt + 1);
        } else {
            self.silent_openings = self.silent_openings.saturating_add(1);
            self.core.request(PortRequest::Reopen);
            self.stage = Stage::Closed;
            self.deadline_ns = None;
        }
    }
}

impl Session for FastrakSession {
    fn port_opening(&mut self, now_ns: u64) {
        self.core.enter(now_ns, SessionState::Opening, None);
    }

    fn port_opened(&mut self, now_ns: u64) {
        self.core.forget_port();
        self.first_bytes.clear();
        self.core.fault =
            self.core.fault.take().filter(|fault| {
                matches!(fault, Fault::Silent { .. } | Fault::NotThisDevice { .. })
            });
        self.reset(now_ns, 0);
    }

    fn port_lost(&mut self, now_ns: u64, fault: Fault) {
        self.framer.clear();
        self.core.forget_port();
        self.stage = Stage::Closed;
        self.deadline_ns = None;
        self.core.enter(now_ns, SessionState::Absent, Some(fault));
    }

    fn push(&mut self, stamp_ns: u64, bytes: &[u8]) {
        self.core.stats.bytes += bytes.len() as u64;
        let room = 64_usize.saturating_sub(self.first_bytes.len());
        self.first_bytes
            .extend_from_slice(&bytes[..bytes.len().min(room)]);
        for part in bytes.chunks(512) {
            if matches!(self.stage, Stage::Closed | Stage::Resetting { .. }) {
                return;
            }
            self.framer.push(stamp_ns, part);
            while let Some(piece) = self.framer.next(&self.format) {
                self.take_piece(stamp_ns, piece);
            }
        }
    }

    fn next_event(&mut self) -> Option<DeviceEvent> {
        self.core.next_event()
    }

    fn deadline(&self) -> Option<u64> {
        self.deadline_ns
    }

    fn handle_timeout(&mut self, now_ns: u64) {
        if self
            .deadline_ns
            .is_none_or(|deadline_ns| now_ns < deadline_ns)
        {
            return;
        }
        match self.stage {
            Stage::Closed => self.deadline_ns = None,
            Stage::Resetting { attempt } => self.ask(now_ns, attempt),
            Stage::Asking { attempt } => self.no_answer(now_ns, attempt),
            Stage::Configuring { .. } => {
                let fault = Fault::Silent { device: FAMILY };
                self.core.enter(now_ns, SessionState::Stalled, Some(fault));
                self.reset(now_ns, 0);
            }
            Stage::Running => self.stall(now_ns, Fault::Silent { device: FAMILY }),
        }
    }

    fn poll_transmit(&mut self) -> Option<Vec<u8>> {
        self.core.next_transmit()
    }

    fn poll_port_request(&mut self) -> Option<PortRequest> {
        self.core.requests.pop_front()
    }

    fn farewell(&self) -> &'static [u8] {
        &[QUIET]
    }

    fn state(&self) -> SessionState {
        self.core.state
    }

    fn fault(&self) -> Option<&Fault> {
        self.core.fault.as_ref()
    }

    fn stats(&self) -> SessionStats {
        self.core.stats
    }
}
