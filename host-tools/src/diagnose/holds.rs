//! What a set of recordings holds, as far as it decides which effects can be told, and which recording would tell more.

use greyrig::effects::{Description, Excitation, InWords, Recording, Role, Separation};

use crate::experiment::{Drive, Experiment};

/// Speed in the rarer direction, relative to that in the other one, from which both count as recorded.
const BOTH: f64 = 0.02;

/// Samples of a period that show a swing that dies away within a few.
const SAMPLES_A_SWING: f64 = 8.0;

/// What a set of recordings holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Holds {
    /// Voltage and current: without, nothing is known of the electrical side by itself.
    pub electrical: bool,
    /// A direct voltage.
    pub direct: bool,
    /// Motion in both directions: without, a constant torque is dry friction.
    pub both_directions: bool,
    /// A locked rotor.
    pub locked_rotor: bool,
    /// An open supply.
    pub open_supply: bool,
    /// Samples close enough to show the inductance: without, what goes with the current's rate is as fast as the
    /// samples.
    pub inductance: bool,
    /// A rotor that turns: without, some effects are one ([`at_standstill`](super::classes::at_standstill)).
    pub motion: bool,
    /// The shortest interval between samples, s: without several of them in a period, what swings cannot be told.
    pub interval_s: f64,
}

impl Holds {
    /// Looks at recordings.
    pub fn of(experiments: &[Experiment]) -> Self {
        let extremes = experiments.iter().filter_map(|e| e.speed.as_ref()).flatten();
        let (low, high) = extremes.fold((0.0f64, 0.0f64), |(l, h), w| (l.min(*w), h.max(*w)));
        let electrical = |e: &&Experiment| e.drive == Drive::Voltage && e.current.is_some();
        let anywhere = |is: fn(&Experiment, usize) -> bool| experiments.iter().any(|e| (0..e.len()).any(|n| is(e, n)));
        Self {
            electrical: experiments.iter().any(|e| electrical(&e)),
            direct: experiments.iter().filter(electrical).any(|e| e.mains_period_s.is_none()),
            locked_rotor: anywhere(Experiment::is_locked),
            open_supply: anywhere(Experiment::is_open),
            inductance: true,
            motion: low < high,
            interval_s: experiments.iter().map(|e| e.interval_s).fold(f64::INFINITY, f64::min),
            both_directions: (-low).min(high) > BOTH * (-low).max(high),
        }
    }

    /// Whether such recordings can tell an effect.
    pub fn tells(self, d: &Description) -> bool {
        let both_directions = d.excited_by.contains(&Excitation::BothDirections);
        let of_rate = d.excited_by.contains(&Excitation::Alternating);
        let is_too_fast = |hz: f64| hz * self.interval_s * SAMPLES_A_SWING > 1.0;
        let swings_unseen = d.parameters.iter().any(|p| p.role == Role::Frequency && is_too_fast(p.start));
        (self.electrical || d.shows_in_motion())
            && !swings_unseen
            && (self.both_directions || !both_directions)
            && (self.inductance || !of_rate)
    }

    /// A locked rotor or an open supply: without, offsets and remanence stand in for each other.
    pub fn takes_a_part_away(self) -> bool {
        self.locked_rotor || self.open_supply
    }

    /// What tells an effect from those that look like it, but for what is there already; if there is any.
    pub fn what_else_tells(self, d: &Description) -> Option<String> {
        let missing = |way: &&Separation| way.asks_for.is_none_or(|recording| !self.has(recording));
        let ways: Vec<Separation> = d.separated_by.iter().filter(missing).copied().collect();
        (!ways.is_empty()).then(|| InWords(&ways).to_string())
    }

    /// The recordings that tell more whatever is missing, but for what is there already.
    pub fn each_part_alone(self) -> String {
        let parts = [
            ("a locked rotor", self.locked_rotor),
            ("DC steps", self.direct),
            ("a coast-down with the supply open", self.open_supply),
        ];
        let missing: Vec<&str> = parts.into_iter().filter(|(_, there)| !there).map(|(part, _)| part).collect();
        match &missing[..] {
            [] => "larger currents and other speeds; the same once more, cold and warm".to_owned(),
            [only] => format!("{only}, which takes one part of the motor away"),
            [first @ .., last] => format!("{} and {last}: each takes one part of the motor away", first.join(", ")),
        }
    }

    fn has(self, recording: Recording) -> bool {
        match recording {
            Recording::LockedRotor => self.locked_rotor,
            Recording::OpenSupply => self.open_supply,
            Recording::BothDirections => self.both_directions,
        }
    }
}

#[cfg(test)]
mod tests {
    use greyrig::effects::EffectId;

    use super::*;

    const AC: Holds = Holds {
        electrical: true,
        direct: false,
        both_directions: false,
        locked_rotor: false,
        open_supply: false,
        inductance: true,
        motion: true,
        interval_s: 1e-4,
    };

    #[test]
    fn a_swing_that_slow_samples_cannot_show_is_not_tried() {
        // A typical one of 30 Hz: 33 samples of a period at 1 kHz, three at 100 Hz.
        let tells = |interval_s: f64| Holds { interval_s, ..AC }.tells(EffectId::TwoMass.description());
        assert!(tells(1e-3) && !tells(1e-2));
        assert!(Holds { interval_s: 1e-2, ..AC }.tells(EffectId::QuadraticLoad.description()));
    }

    #[test]
    fn what_is_there_already_is_not_asked_for() {
        let told = |holds: Holds, id: EffectId| holds.what_else_tells(id.description());
        assert!(
            told(AC, EffectId::Remanence)
                .is_some_and(|ways| ways.contains("open supply") && ways.contains("locked rotor"))
        );
        let locked = Holds { locked_rotor: true, ..AC };
        assert!(
            told(locked, EffectId::Remanence)
                .is_some_and(|ways| ways.contains("open supply") && !ways.contains("locked"))
        );
        assert_eq!(told(Holds { open_supply: true, ..locked }, EffectId::Remanence), None);
    }

    #[test]
    fn the_parts_that_are_missing_are_asked_for() {
        assert_eq!(
            AC.each_part_alone(),
            "a locked rotor, DC steps and a coast-down with the supply open: each takes one part of the motor away"
        );
        let one = Holds { locked_rotor: true, direct: true, ..AC };
        assert!(one.each_part_alone().starts_with("a coast-down"));
        let all = Holds { open_supply: true, ..one }.each_part_alone();
        assert!(["locked", "DC", "coast"].iter().all(|part| !all.contains(part)), "{all}");
    }
}
