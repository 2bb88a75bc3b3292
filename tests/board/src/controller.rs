//! What a rig's controller makes of the pins (docs/wiring.md): a motor passes while the pass pulses.

use crate::board::Board;

/// Without a change for so long, the pass has ended, s: 2.5 pulses.
const STILL_S: f64 = 0.25;

/// What the controller sees.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Seen {
    /// Neither pass nor alarm.
    #[default]
    Nothing,
    /// The pass pulses.
    Pass,
    /// The alarm is high.
    Alarm,
}

/// The controller's inputs.
#[derive(Debug, Clone, Default)]
pub struct Controller {
    pass: bool,
    /// When the pass has changed last, and the time before that, s.
    changed: [f64; 2],
}

impl Controller {
    /// Looks at the pins, more often than they change.
    pub fn look(&mut self, board: &Board) -> Seen {
        let now = board.seconds();
        let pass = board.is_high("PB10");
        if pass != self.pass {
            self.pass = pass;
            self.changed = [now, self.changed[0]];
        }
        match () {
            () if board.is_high("PB5") => Seen::Alarm,
            // Two changes: a pin that has once gone high is no pulse.
            () if now - self.changed[1] < STILL_S && self.changed[1] > 0.0 => Seen::Pass,
            () => Seen::Nothing,
        }
    }
}
