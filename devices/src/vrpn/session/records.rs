//! The messages of the device itself: poses, channels, buttons.

use crate::session::{DeviceEvent, SessionState};
use crate::vrpn::body::{ButtonChange, PosQuat, Text, decode_button_states, decode_channels};
use crate::vrpn::message::Message;
use crate::vrpn::names::{ANALOG_CHANNEL, BUTTON_CHANGE, BUTTON_STATES, PONG, POS_QUAT, TEXT};
use crate::vrpn::readings::Arrival;

use super::VrpnSession;

impl VrpnSession {
    pub(super) fn take_from_device(
        &mut self,
        stamp_ns: u64,
        message: &Message<'_>,
        kind: &str,
        is_datagram: bool,
    ) {
        let at = Arrival {
            stamp_ns,
            unix_us: message.header.time.unix_us(),
            is_datagram,
        };
        let body = message.body;
        match kind {
            PONG => self.answered(stamp_ns),
            POS_QUAT => {
                let pose = PosQuat::decode(body);
                let reading = pose.and_then(|pose| self.readings.pose(&self.settings, at, &pose));
                let is_good = reading.is_some();
                if let Some(reading) = reading {
                    self.heard.pose_ns = Some(stamp_ns);
                    self.accept(stamp_ns, Some(DeviceEvent::Tracker(reading)));
                }
                self.count_dropped(is_good);
            }
            ANALOG_CHANNEL => {
                let Some(values) = decode_channels(body) else {
                    return self.count_dropped(false);
                };
                let (settings, calibration) = (&self.settings, &self.calibration);
                let reading = self.readings.channels(settings, calibration, at, &values);
                self.accept_glove(stamp_ns, reading.map(DeviceEvent::Glove));
            }
            BUTTON_CHANGE => {
                let Some(change) = ButtonChange::decode(body) else {
                    return self.count_dropped(false);
                };
                self.readings.button(change);
                self.accept_buttons(at);
            }
            BUTTON_STATES => {
                let Some(states) = decode_button_states(body) else {
                    return self.count_dropped(false);
                };
                self.readings.buttons(&states);
                self.accept_buttons(at);
            }
            TEXT => {
                let is_error = Text::decode(body).is_some_and(|text| text.severity >= 2);
                self.core.stats.device_errors += u64::from(is_error);
            }
            _ => {}
        }
    }

    fn accept_buttons(&mut self, at: Arrival) {
        let reading = self.readings.glove(&self.settings, &self.calibration, at);
        self.accept_glove(at.stamp_ns, reading.map(DeviceEvent::Glove));
    }

    fn accept_glove(&mut self, stamp_ns: u64, event: Option<DeviceEvent>) {
        if event.is_some() {
            self.heard.glove_ns = Some(stamp_ns);
        }
        self.accept(stamp_ns, event);
    }

    /// A good record of the device.
    fn accept(&mut self, stamp_ns: u64, event: Option<DeviceEvent>) {
        self.core.stats.records += 1;
        self.heard.has_record = true;
        self.answered(stamp_ns);
        self.core.enter(stamp_ns, SessionState::Running, None);
        if let Some(event) = event {
            self.core.emit(event);
        }
    }

    fn count_dropped(&mut self, is_good: bool) {
        self.core.stats.dropped_records += u64::from(!is_good);
    }
}
