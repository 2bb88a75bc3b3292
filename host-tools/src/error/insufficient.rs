//! What recordings do not hold that is asked of them.

/// What recordings do not hold that is asked of them.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Insufficient {
    /// Voltage, current and speed rest at one operating point.
    #[error("voltage, current and speed hardly change: one operating point fits any motor")]
    OneOperatingPoint,
    /// No current, and these parameters of the electrical side are not known.
    #[error("without a current (i_a), {} cannot be identified", .0.join(" and "))]
    NoCurrent(Vec<&'static str>),
    /// No current of a motor whose flux is the current.
    #[error("without a current (i_a), a universal motor cannot be identified: its flux is the current")]
    NoFlux,
    /// No speed, and a rotor that is not held.
    #[error("without a speed (omega_rad_s), K, J and the friction cannot be identified")]
    NoSpeed,
    /// Parameter after parameter had to be held, for these reasons.
    #[error("nothing is left that these recordings determine ({})", .0.join("; "))]
    NothingDetermined(Vec<String>),
    /// Every sample is in a gap, clipped or marked as not valid.
    #[error("no sample of these recordings can be used")]
    NoUsableSample,
    /// Too few rows for the mechanical side, or too little motion in them.
    #[error("these recordings are too short or hold too little motion to fit the mechanical side")]
    TooLittleMotion,
    /// Neither side of the motor can be written down.
    #[error("these recordings hold neither voltage and current nor torque and motion")]
    NeitherSide,
    /// The model has no dry friction, and of what that would do here only this share shows.
    #[error(
        "the model has no dry friction, and only {:.1} % of what dry friction would do here is not what the back-EMF and the inertia do \
         already",
        100.0 * .0
    )]
    HiddenDryFriction(f64),
}

impl Insufficient {
    /// What the user can do about it.
    pub fn remedy(&self) -> String {
        match self {
            Self::OneOperatingPoint => {
                "record a run-up, a staircase or a ramp of the voltage, and a coast-down for the friction".to_owned()
            }
            Self::NoCurrent(open) => {
                let known: Vec<String> = open.iter().map(|name| format!("--fix {name}=VALUE")).collect();
                format!("record the current, or give what you know with {}", known.join(" "))
            }
            Self::NoFlux => "record the current, or use --kind pm-dc if the motor has magnets".to_owned(),
            Self::NoSpeed => {
                "record the speed; if the rotor was held, say so with a line '# rotor: locked' or a column \
                              rotor_locked"
                    .to_owned()
            }
            Self::NothingDetermined(_) => "record more excitation, or give what you know with --fix".to_owned(),
            Self::NoUsableSample => "look at the warnings about gaps and clipping".to_owned(),
            Self::TooLittleMotion => "record a longer motion with changes of speed in both directions".to_owned(),
            Self::NeitherSide => "record voltage, current and speed".to_owned(),
            Self::HiddenDryFriction(_) => "record a coast-down, or several steady speeds".to_owned(),
        }
    }
}
