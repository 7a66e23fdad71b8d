//! The bend sensors of a glove, named for the joint that each measures.

use serde::{Deserialize, Serialize};

/// A bend sensor; the discriminant is its slot on the wire.
///
/// Slots 7 (absolute abduction of the index finger, never built) and 23 (spare) have no name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GloveSensor {
    /// Thumb CMC roll across the palm.
    ThumbRotation = 0,
    /// Thumb MCP flexion.
    ThumbMcp = 1,
    /// Thumb IP flexion.
    ThumbIp = 2,
    /// Thumb abduction from the index finger.
    ThumbAbduction = 3,
    /// Index finger MCP flexion.
    IndexMcp = 4,
    /// Index finger PIP flexion.
    IndexPip = 5,
    /// Index finger DIP flexion; not on an 18-sensor glove.
    IndexDip = 6,
    /// Middle finger MCP flexion.
    MiddleMcp = 8,
    /// Middle finger PIP flexion.
    MiddlePip = 9,
    /// Middle finger DIP flexion; not on an 18-sensor glove.
    MiddleDip = 10,
    /// Angle between middle and index finger.
    MiddleIndexAbduction = 11,
    /// Ring finger MCP flexion.
    RingMcp = 12,
    /// Ring finger PIP flexion.
    RingPip = 13,
    /// Ring finger DIP flexion; not on an 18-sensor glove.
    RingDip = 14,
    /// Angle between ring and middle finger.
    RingMiddleAbduction = 15,
    /// Little finger MCP flexion.
    LittleMcp = 16,
    /// Little finger PIP flexion.
    LittlePip = 17,
    /// Little finger DIP flexion; not on an 18-sensor glove.
    LittleDip = 18,
    /// Angle between little and ring finger.
    LittleRingAbduction = 19,
    /// Arch of the palm: the little finger's side moving across it.
    PalmArch = 20,
    /// Wrist flexion.
    WristFlexion = 21,
    /// Wrist abduction, sideways.
    WristAbduction = 22,
}

impl GloveSensor {
    /// Number of wire slots, two of them without a sensor.
    pub const N_SLOTS: usize = 24;

    /// Every sensor, in the order of the record.
    pub const ALL: [Self; 22] = [
        Self::ThumbRotation,
        Self::ThumbMcp,
        Self::ThumbIp,
        Self::ThumbAbduction,
        Self::IndexMcp,
        Self::IndexPip,
        Self::IndexDip,
        Self::MiddleMcp,
        Self::MiddlePip,
        Self::MiddleDip,
        Self::MiddleIndexAbduction,
        Self::RingMcp,
        Self::RingPip,
        Self::RingDip,
        Self::RingMiddleAbduction,
        Self::LittleMcp,
        Self::LittlePip,
        Self::LittleDip,
        Self::LittleRingAbduction,
        Self::PalmArch,
        Self::WristFlexion,
        Self::WristAbduction,
    ];

    /// The wire slot, 0 to 22.
    #[must_use]
    pub const fn slot(self) -> usize {
        self as usize
    }

    /// The name in calibration files and on our wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::ThumbRotation => "thumb_rotation",
            Self::ThumbMcp => "thumb_mcp",
            Self::ThumbIp => "thumb_ip",
            Self::ThumbAbduction => "thumb_abduction",
            Self::IndexMcp => "index_mcp",
            Self::IndexPip => "index_pip",
            Self::IndexDip => "index_dip",
            Self::MiddleMcp => "middle_mcp",
            Self::MiddlePip => "middle_pip",
            Self::MiddleDip => "middle_dip",
            Self::MiddleIndexAbduction => "middle_index_abduction",
            Self::RingMcp => "ring_mcp",
            Self::RingPip => "ring_pip",
            Self::RingDip => "ring_dip",
            Self::RingMiddleAbduction => "ring_middle_abduction",
            Self::LittleMcp => "little_mcp",
            Self::LittlePip => "little_pip",
            Self::LittleDip => "little_dip",
            Self::LittleRingAbduction => "little_ring_abduction",
            Self::PalmArch => "palm_arch",
            Self::WristFlexion => "wrist_flexion",
            Self::WristAbduction => "wrist_abduction",
        }
    }

    /// The sensor of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|sensor| sensor.name() == name)
    }

    /// The sensor of a wire slot; `None` for the two slots without one, and beyond the last.
    #[must_use]
    pub fn from_slot(slot: usize) -> Option<Self> {
        Self::ALL.into_iter().find(|sensor| sensor.slot() == slot)
    }
}

/// A set of wire slots: which sensors a glove has, or sends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SensorMask(u32);

impl SensorMask {
    /// The slots of an 18-sensor glove: all but the DIP joints of the four fingers.
    pub const EIGHTEEN: Self = Self(0x7B_BB3F);
    /// The slots of a 22-sensor glove.
    pub const TWENTY_TWO: Self = Self(0x7F_FF7F);

    /// From the three bytes of the wire, least significant first.
    #[must_use]
    pub const fn from_wire(bytes: [u8; 3]) -> Self {
        Self(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], 0]))
    }

    /// The three bytes of the wire, least significant first.
    #[must_use]
    pub const fn to_wire(self) -> [u8; 3] {
        let [low, middle, high, _] = self.0.to_le_bytes();
        [low, middle, high]
    }

    /// The mask of a glove with `n_sensors`; `None` unless that is 18 or 22.
    #[must_use]
    pub const fn from_count(n_sensors: usize) -> Option<Self> {
        match n_sensors {
            18 => Some(Self::EIGHTEEN),
            22 => Some(Self::TWENTY_TWO),
            _ => None,
        }
    }

    /// How many sensors are in the set.
    #[must_use]
    pub const fn count(self) -> usize {
        self.0.count_ones() as usize
    }

    /// The slots in the order of the record.
    pub fn slots(self) -> impl Iterator<Item = usize> {
        (0..GloveSensor::N_SLOTS).filter(move |slot| self.0 & (1 << slot) != 0)
    }

    /// The slots that are in both sets.
    #[must_use]
    pub const fn intersection(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

#[cfg(test)]
mod tests {
    use super::{GloveSensor, SensorMask};

    fn record_index(mask: SensorMask, sensor: GloveSensor) -> Option<usize> {
        mask.slots().position(|slot| slot == sensor.slot())
    }

    #[test]
    fn masks_are_those_of_the_wire() {
        assert_eq!(SensorMask::EIGHTEEN.to_wire(), [0x3F, 0xBB, 0x7B]);
        assert_eq!(SensorMask::TWENTY_TWO.to_wire(), [0x7F, 0xFF, 0x7F]);
        assert_eq!(
            SensorMask::from_wire([0x3F, 0xBB, 0x7B]),
            SensorMask::EIGHTEEN
        );
        assert_eq!(SensorMask::EIGHTEEN.count(), 18);
        assert_eq!(SensorMask::TWENTY_TWO.count(), 22);
    }

    #[test]
    fn every_slot_of_the_full_mask_has_a_name() {
        let names: Vec<GloveSensor> = SensorMask::TWENTY_TWO
            .slots()
            .filter_map(GloveSensor::from_slot)
            .collect();
        assert_eq!(names, GloveSensor::ALL);
        assert_eq!(GloveSensor::from_slot(7), None);
        assert_eq!(GloveSensor::from_slot(23), None);
    }

    #[test]
    fn the_record_order_is_that_of_the_manual() {
        let cases = [
            (GloveSensor::ThumbAbduction, Some(3), Some(3)),
            (GloveSensor::IndexDip, Some(6), None),
            (GloveSensor::MiddleMcp, Some(7), Some(6)),
            (GloveSensor::MiddleIndexAbduction, Some(10), Some(8)),
            (GloveSensor::LittlePip, Some(16), Some(13)),
            (GloveSensor::PalmArch, Some(19), Some(15)),
            (GloveSensor::WristAbduction, Some(21), Some(17)),
        ];
        for (sensor, of_22, of_18) in cases {
            assert_eq!(record_index(SensorMask::TWENTY_TWO, sensor), of_22);
            assert_eq!(record_index(SensorMask::EIGHTEEN, sensor), of_18);
        }
    }
}
