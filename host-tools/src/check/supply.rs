//! The supply's voltage, or a controller's command, in the place of the motor's voltage.
//!
//! At a constant voltage R i + K ω is constant, too: current and speed of a loaded motor go against each other on one
//! line. A supply's voltage rests (or sags by a cable's resistance) while current and speed go their own ways.

use super::balance::Window;
use super::criteria::T_SIGN;
use super::evidence::{Evidence, variance};
use super::regression;
use super::signals::Signals;
use crate::model::Kind;
use crate::recording::Channel;
use crate::recording::finding::{Code, DataFinding, Severity};

/// Relative deviation of a battery's voltage under load.
const RESTS: f64 = 0.2;
/// The same of a speed that is driven somewhere.
const DRIVEN: f64 = 0.3;
/// Share of the speed's variance that current and voltage leave: on one line none is left.
const OFF_THE_LINE: f64 = 0.3;

/// Words of column names that mean a supply, and those that mean a duty cycle.
const SUPPLY: [&str; 9] = ["input_v", "v_in", "vin", "batt", "vbat", "supply", "bus", "dc_link", "udc"];
const DUTY: [&str; 3] = ["duty", "pwm", "modulation"];

/// What to look for.
pub fn look(s: &Signals<'_>, e: &Evidence, kind: Kind, found: &mut Vec<DataFinding>) {
    let Some(u) = s.usable(Channel::Voltage) else { return };
    let source = s.source(Channel::Voltage).name;
    let extras = s.recording().extras().iter();
    let duty = extras.clone().find(|x| DUTY.iter().any(|word| x.name.to_lowercase().contains(word)));
    let named = SUPPLY.iter().any(|word| source.to_lowercase().replace(' ', "_").contains(word));
    let product = |duty: &str| format!("--map 'u_v={source}*{duty}'");
    if kind == Kind::PmDc || e.told == Some(Kind::PmDc) || named {
        let by_itself = goes_its_own_way(&e.long.iter().filter(|x| !x.locked).copied().collect::<Vec<_>>());
        if (named && duty.is_some()) || by_itself {
            let text = match duty {
                Some(duty) => format!(
                    "the voltage is the supply's ('{source}'), not the motor's: that is '{}' times it",
                    duty.name
                ),
                None => {
                    "the voltage rests while current and speed go their own ways: it is the supply's, not the motor's"
                        .to_owned()
                }
            };
            let mut finding = s.finding(Code::SupplyVoltage, Severity::Stop, text).on(Channel::Voltage);
            if let Some(duty) = duty {
                finding = finding.remedy(product(&duty.name));
            }
            found.push(finding);
            return;
        }
    }
    if let Some(finding) = commanded(s, &u) {
        found.push(finding);
    }
}

fn goes_its_own_way(windows: &[Window]) -> bool {
    let deviation = |of: fn(&Window) -> f64| {
        let mean = windows.iter().map(of).sum::<f64>() / windows.len().max(1) as f64;
        (variance(windows.iter().map(of)).sqrt(), mean.abs())
    };
    let ((u, level), (w, speed)) = (deviation(|x| x.u), deviation(|x| x.w));
    if !(level > 0.0 && u < RESTS * level && w > DRIVEN * speed) {
        return false;
    }
    // ω on 1, i, di/dt, u: all that a constant voltage leaves to it.
    let line = regression::fit(windows.iter().map(|x| ([1.0, x.i, x.di, x.u], x.w)));
    line.is_some_and(|f| f.unexplained > OFF_THE_LINE || f.t[1] > T_SIGN)
}

/// A voltage of a few exact values beside a current with noise.
fn commanded(s: &Signals<'_>, u: &[f64]) -> Option<DataFinding> {
    /// More levels than a program of steps has.
    const LEVELS: usize = 64;
    let current = s.usable(Channel::Current)?;
    let repeats = |x: &[f64]| x.windows(2).filter(|w| w[0] == w[1]).count() as f64 / x.len().max(2) as f64;
    let mut values = u.to_vec();
    values.sort_by(f64::total_cmp);
    values.dedup();
    let exact = values.len() >= 2 && values.len() <= LEVELS && values.len() * 50 < u.len() && repeats(u) > 0.95;
    (exact && repeats(&current) < 0.7).then(|| {
        s.finding(
            Code::CommandedVoltage,
            Severity::Info,
            format!(
                "the voltage takes {} exact values: it is what was commanded, and the supply's drop is not in it",
                values.len()
            ),
        )
        .on(Channel::Voltage)
    })
}
