//! Whether anything is left to explain: the residual against what does not repeat.
//!
//! Structure repeats from one mains period to the next (without mains: from one 20 ms to the next), noise does not. The floor
//! of the voltage balance is therefore the RMS of `(e(t + T) − e(t))/√2`; that of the torque balance, which is known once
//! per window, the RMS of the second difference of neighbouring windows over √6. Both hold turbulence, sparking and every
//! other disturbance that no model of the mean can know.

use crate::identify::minimise::{Refined, Residuals};

/// Residual over floor below which a balance is complete.
const COMPLETE: f64 = 1.35;
/// Share of the structure that has to be explained where the floor is not reached: another form of the right law leaves
/// less, the wrong law more.
const EXPLAINED: f64 = 0.9;
/// The same in the free run.
const EXPLAINED_IN_FREE_RUN: f64 = 0.97;
/// Residual over floor below which little is left, whatever there was.
const NEARLY_COMPLETE: f64 = 1.5;

/// Residual over what does not repeat, for the voltage and the torque balance; 1 is perfect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Completeness {
    /// Voltage balance.
    pub electrical: f64,
    /// Torque balance.
    pub mechanical: f64,
}

/// What does not repeat: RMS of the voltage balance (V) and the torque balance (N m s per window).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Floor([f64; 2]);

impl Floor {
    /// Nothing is known; then no structure is claimed.
    pub const UNKNOWN: Self = Self([0.0; 2]);

    /// Whether it is known.
    pub fn is_known(&self) -> bool {
        self.0.iter().any(|f| *f > 0.0)
    }

    /// From a fit; `times` are recording and time of each row, `period_s` that of the mains. Structure that grows or fades
    /// counts to some degree, so the floor of the best fit is that of all.
    pub fn of(fit: &Refined, problem: &impl Residuals, times: &[(usize, f64)], period_s: f64) -> Self {
        let groups = problem.groups();
        let rows_of = |group: u8| (0..groups.len()).filter(|k| groups[*k] == group).collect::<Vec<usize>>();
        let rows = rows_of(0);
        let step = rows.windows(2).map(|w| times[w[1]].1 - times[w[0]].1).find(|d| *d > 0.0).unwrap_or(1e-3);
        let lag = (period_s / step).round().max(1.0) as usize;
        let apart = (0..rows.len().saturating_sub(lag)).filter_map(|k| {
            let (a, b) = (rows[k], rows[k + lag]);
            let gap = times[b].1 - times[a].1;
            (times[a].0 == times[b].0 && (gap - period_s).abs() < step)
                .then(|| (fit.residuals[b] - fit.residuals[a]).powi(2) / 2.0)
        });
        let electrical = mean(apart);
        let rows = rows_of(1);
        let bent = rows.windows(3).filter_map(|w| {
            let [a, b, c] = [w[0], w[1], w[2]];
            let even = ((times[c].1 - times[b].1) - (times[b].1 - times[a].1)).abs() < 1e-9;
            (times[a].0 == times[c].0 && even)
                .then(|| (fit.residuals[a] - 2.0 * fit.residuals[b] + fit.residuals[c]).powi(2) / 6.0)
        });
        let mechanical = mean(bent);
        Self([electrical.sqrt() * fit.rms[0], mechanical.sqrt() * fit.rms[1]])
    }
}

/// Mean of squares; none: not known, 0.
fn mean(squares: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = squares.fold((0.0, 0.0), |(s, n), x| (s + x, n + 1.0));
    if count < 8.0 { 0.0 } else { sum / count }
}

impl Completeness {
    /// Of a fit against a floor.
    pub fn of(fit: &Refined, floor: &Floor) -> Self {
        let ratio = |g: usize| if floor.0[g] > 0.0 { fit.rms[g] / floor.0[g] } else { 1.0 };
        Self { electrical: ratio(0), mechanical: ratio(1) }
    }

    /// Whether no structure is left in either balance.
    pub fn is_complete(&self) -> bool {
        self.electrical < COMPLETE && self.mechanical < COMPLETE
    }

    /// Whether nearly all structure of an earlier fit is explained in this one, balance by balance. Each may be explained in
    /// the free run instead (`free_run`, without and with what was found), which adds up over time what one balance hardly
    /// shows: there, of course, more has to be explained. What is left of a balance may also be little by itself, where what
    /// is left of both is little of what there was.
    pub fn explains(&self, before: &Self, free_run: Option<&(Self, Self)>) -> bool {
        let balances = self.explained(before, EXPLAINED);
        let free = free_run.map_or([false; 2], |(before, after)| after.explained(before, EXPLAINED_IN_FREE_RUN));
        // Where the free run alone explains a signal, it also tells how much there was and is left.
        let judges = [0, 1].map(|g| match free_run {
            Some((before, after)) if free[g] && !balances[g] => (before.both()[g], after.both()[g]),
            _ => (before.both()[g], self.both()[g]),
        });
        let [over, left] =
            [judges.map(|j| j.0), judges.map(|j| j.1)].map(|x| x.iter().map(|c| (c - 1.0).max(0.0)).sum::<f64>());
        let little = left <= (1.0 - EXPLAINED) * over;
        (0..2).all(|g| balances[g] || free[g] || (little && judges[g].1 < NEARLY_COMPLETE))
    }

    fn both(&self) -> [f64; 2] {
        [self.electrical, self.mechanical]
    }

    fn explained(&self, before: &Self, share: f64) -> [bool; 2] {
        let of = |before: f64, after: f64| after < COMPLETE || (after - 1.0) <= (1.0 - share) * (before - 1.0);
        [of(before.electrical, self.electrical), of(before.mechanical, self.mechanical)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(electrical: f64, mechanical: f64) -> Completeness {
        Completeness { electrical, mechanical }
    }

    #[test]
    fn both_balances_have_to_be_explained() {
        assert!(of(2.8, 1.1).explains(&of(20.0, 1.1), None));
        assert!(!of(2.8, 4.0).explains(&of(20.0, 5.0), None));
        assert!(!of(3.0, 1.1).explains(&of(20.0, 1.1), None));
    }

    #[test]
    fn a_little_that_is_left_does_not_hide_what_was_explained() {
        assert!(of(1.2, 1.45).explains(&of(12.0, 1.45), None));
        assert!(!of(1.2, 1.45).explains(&of(2.0, 1.45), None), "it is a third of what there was");
        assert!(!of(1.2, 1.6).explains(&of(12.0, 1.6), None), "it is not little");
        assert!(of(1.8, 1.4).explains(&of(33.0, 2.3), None), "a fortieth of the voltage's, little of the torque's");
    }

    #[test]
    fn the_free_run_can_stand_in_for_one_balance() {
        let (before, after) = (of(19.0, 2.8), of(5.5, 0.8));
        assert!(after.explains(&before, Some(&(of(80.0, 4.5), of(2.2, 3.3)))));
        assert!(!after.explains(&before, Some(&(of(80.0, 4.5), of(8.0, 3.3)))), "a tenth is left");
        assert!(!of(5.5, 2.5).explains(&before, Some(&(of(80.0, 4.5), of(2.2, 3.3)))), "nor the torque");
        assert!(of(4.0, 1.43).explains(&of(56.0, 2.5), Some(&(of(81.0, 6.3), of(1.2, 3.9)))), "little of the torque's");
    }
}
