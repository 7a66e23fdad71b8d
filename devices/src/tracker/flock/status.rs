//! What a unit says about itself when it is examined. Answers have no framing but their length.

use crate::tracker::flock::protocol::{
    FULL_RANGE, N_ADDRESSES, UNIT_FLIES, UNIT_HAS_SENSOR, rate_hz,
};

/// Frequencies that a unit's crystal may have, MHz.
const CRYSTALS_MHZ: std::ops::RangeInclusive<u16> = 8..=100;

/// The answers that came.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct UnitStatus {
    crystal_mhz: u16,
    count: u16,
    /// Firmware revision as text; empty until it is told.
    pub(super) firmware: String,
    model: String,
}

impl UnitStatus {
    /// Takes the crystal's frequency; false when it is none.
    pub(super) fn take_crystal(&mut self, bytes: [u8; 2]) -> bool {
        self.crystal_mhz = u16::from_le_bytes(bytes);
        CRYSTALS_MHZ.contains(&self.crystal_mhz)
    }

    /// Measurements per second of each bird; `None` before the unit was asked, or when its answers make none.
    pub(super) fn rate_hz(&self) -> Option<f64> {
        rate_hz(self.count, self.crystal_mhz).filter(|rate_hz| *rate_hz < FULL_RANGE)
    }

    /// Takes the count of the measurement rate.
    pub(super) const fn take_rate(&mut self, bytes: [u8; 2]) {
        self.count = u16::from_le_bytes(bytes);
    }

    /// Takes the firmware revision, of which the low byte is taken for the part behind the point.
    pub(super) fn take_firmware(&mut self, [low, high]: [u8; 2]) {
        self.firmware = format!("{high}.{low}");
    }

    /// Takes the model's name.
    pub(super) fn take_model(&mut self, bytes: &[u8]) {
        let shown = |byte: &&u8| byte.is_ascii_graphic() || **byte == b' ';
        let text: String = bytes
            .iter()
            .filter(shown)
            .map(|byte| char::from(*byte))
            .collect();
        text.trim().clone_into(&mut self.model);
    }

    /// Model and measurement rate, as far as they were told.
    pub(super) fn identity(&self) -> String {
        let rate = self
            .rate_hz()
            .map_or_else(String::new, |rate_hz| format!("{rate_hz:.2} Hz"));
        [self.model.as_str(), &rate]
            .into_iter()
            .filter(|part| !part.is_empty())
            .collect::<Vec<_>>()
            .join(", ")
    }
}

/// Addresses that fly and have a sensor.
pub(super) fn flying(bus: &[u8; N_ADDRESSES]) -> Vec<u8> {
    let needed = UNIT_FLIES | UNIT_HAS_SENSOR;
    (1..)
        .zip(bus)
        .filter_map(|(address, unit)| (unit & needed == needed).then_some(address))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{UnitStatus, flying};

    #[test]
    fn answers_become_text() {
        let mut status = UnitStatus::default();
        assert_eq!(status.identity(), "");
        assert!(status.take_crystal([40, 0]) && !status.take_crystal([0x4F, 0x02]));
        assert!(status.take_crystal([40, 0]));
        status.take_rate([0xB4, 0x2D]);
        status.take_model(b"6DFOB    \0");
        status.take_firmware([67, 3]);
        assert_eq!(status.identity(), "6DFOB, 103.52 Hz");
        assert_eq!(status.firmware, "3.67");
    }

    #[test]
    fn a_controller_is_no_bird() {
        let mut bus = [0; 14];
        bus[0] = 0xD0;
        bus[1] = 0xE0;
        bus[2] = 0x20;
        assert_eq!(flying(&bus), [2]);
    }
}
