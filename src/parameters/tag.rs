//! What a section of the parameters holds, by number and version.

/// What a section holds. Numbers are never used again for anything else.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Tag {
    /// Names of the motor type and, in blocks of before, the rig.
    Identity = 0x01,
    /// Calibration of the three channels: in the rig's block, and in a motor's of before.
    Calibration = 0x02,
    /// Settings of the filter.
    Filter = 0x03,
    /// Base model.
    Motor = 0x04,
    /// Effects: identifiers and values.
    Effects = 0x05,
    /// Terms of the user's own.
    Terms = 0x06,
    /// Learned correction; need not be there.
    Correction = 0x07,
    /// Thresholds of the detector; need not be there.
    Detector = 0x08,
    /// Name of the rig, in its own block.
    Rig = 0x09,
    /// Which greyrig has written a motor's block, and for which image of the firmware; need not be there.
    Origin = 0x0A,
    /// Profile and limits of the station's sequence; need not be there.
    Sequence = 0x0B,
    /// The rig's supply, in its own block; need not be there.
    Supply = 0x0C,
}

impl Tag {
    /// All tags with the version that is written, and the only one that is read; none: reserved for later.
    pub const ALL: [(Self, Option<u8>); 12] = [
        (Self::Identity, Some(1)),
        (Self::Calibration, Some(1)),
        (Self::Filter, Some(1)),
        (Self::Motor, Some(1)),
        (Self::Effects, Some(1)),
        (Self::Terms, Some(1)),
        (Self::Correction, Some(1)),
        (Self::Detector, Some(1)),
        (Self::Rig, Some(1)),
        (Self::Origin, Some(1)),
        (Self::Sequence, Some(1)),
        (Self::Supply, Some(1)),
    ];

    /// What messages call it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Identity => "identity",
            Self::Calibration => "calibration",
            Self::Filter => "filter",
            Self::Motor => "motor",
            Self::Effects => "effects",
            Self::Terms => "terms",
            Self::Correction => "correction",
            Self::Detector => "detector",
            Self::Rig => "rig",
            Self::Origin => "origin",
            Self::Sequence => "sequence",
            Self::Supply => "supply",
        }
    }

    /// Whether a motor's block can do without.
    pub(super) const fn is_optional(self) -> bool {
        !matches!(self, Self::Identity | Self::Filter | Self::Motor | Self::Effects | Self::Terms)
    }

    /// The tag of a number, where this version of its section can be read.
    pub(super) fn known(number: u8, version: u8) -> Option<Self> {
        let known = |(tag, known): &(Self, Option<u8>)| *tag as u8 == number && *known == Some(version);
        Self::ALL.into_iter().find(known).map(|(tag, _)| tag)
    }

    /// The version that is written.
    pub(super) fn version(self) -> u8 {
        Self::ALL.into_iter().find(|(tag, _)| *tag == self).and_then(|(_, version)| version).unwrap_or(0)
    }
}
