//! Where a fault sits, from the signs of the two deviations.
//!
//! The model runs freely from the voltage, so a fault moves the motor's current and speed away from the model's, and a
//! wrong sensor moves its own signal alone:
//!
//! | current | speed | where |
//! | --- | --- | --- |
//! | less | slower | electrical: resistance up |
//! | more | slower | mechanical: more load or friction |
//! | less | faster | mechanical: less load |
//! | more | faster | electrical: resistance or flux down |
//! | any | as it was | sensor of the current |
//! | as it was | any | sensor of the speed |
//!
//! Sparking brushes take voltage, which looks like a resistance, and are told by the current above 1 kHz.

/// Where a fault sits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Kind {
    /// Supply, winding, brushes.
    Electrical,
    /// Bearings, fan, load.
    Mechanical,
    /// Measuring chain.
    Sensor,
}

impl Kind {
    /// All of them, in order of declaration.
    pub const ALL: [Self; 3] = [Self::Electrical, Self::Mechanical, Self::Sensor];

    /// In one word.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Electrical => "electrical",
            Self::Mechanical => "mechanical",
            Self::Sensor => "sensor",
        }
    }
}

/// A deviation below this share of the other one counts as none.
const NONE: f32 = 0.1;

/// Where a fault sits that makes deviations of the current and the speed.
pub fn locate(current_deviation: f32, speed_deviation: f32) -> Kind {
    let (current, speed) = (current_deviation.abs(), speed_deviation.abs());
    if speed < NONE * current || current < NONE * speed {
        return Kind::Sensor;
    }
    if (current_deviation > 0.0) == (speed_deviation > 0.0) { Kind::Electrical } else { Kind::Mechanical }
}
