//! Measured quantities and their units.

/// A measured quantity that the models know. The discriminant is the order of the columns in files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Channel {
    /// Supply voltage at the motor's terminals, V (`u_v`).
    Voltage,
    /// Current, A (`i_a`).
    Current,
    /// Speed, rad/s, or m/s of a linear drive (`omega_rad_s`).
    Speed,
    /// Position, rad or m (`angle_rad`); stands in for the speed.
    Angle,
    /// Torque, N m, or force, N (`torque_n_m`); stands in for K i.
    Torque,
}

impl Channel {
    /// All channels, in the order of the columns of a file.
    pub const ALL: [Self; 5] = [Self::Voltage, Self::Current, Self::Speed, Self::Angle, Self::Torque];

    /// The column name of the interface.
    pub const fn column(self) -> &'static str {
        match self {
            Self::Voltage => "u_v",
            Self::Current => "i_a",
            Self::Speed => "omega_rad_s",
            Self::Angle => "angle_rad",
            Self::Torque => "torque_n_m",
        }
    }

    /// The SI unit of its values.
    pub const fn unit(self, motion: Motion) -> &'static str {
        match (self, motion) {
            (Self::Voltage, _) => "V",
            (Self::Current, _) => "A",
            (Self::Speed, Motion::Rotary) => "rad/s",
            (Self::Speed, Motion::Linear) => "m/s",
            (Self::Angle, Motion::Rotary) => "rad",
            (Self::Angle, Motion::Linear) => "m",
            (Self::Torque, Motion::Rotary) => "N m",
            (Self::Torque, Motion::Linear) => "N",
        }
    }
}

/// Whether the drive turns or slides; decides on the units that are printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Motion {
    /// rad, rad/s, N m, kg m².
    #[default]
    Rotary,
    /// m, m/s, N, kg.
    Linear,
}
