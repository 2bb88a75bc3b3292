//! A file of another program, with names and units of its own:
//! `cargo run --release -p greyrig-host --example foreign_file`.

use std::io::Write;

use greyrig_host::context::Context;
use greyrig_host::recording::{Channel, Mapping, load};

/// Runs the example.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    // An oscilloscope's table: milliseconds, a divider of 1:100 and a shunt of 10 mΩ, and the speed in revolutions per
    // minute.
    let mut file = tempfile::Builder::new().suffix(".csv").tempfile()?;
    writeln!(file, "Time [ms];CH1 [V];CH2 [V];Speed [rpm]")?;
    for n in 0..200 {
        writeln!(
            file,
            "{:.1};{:.3};{:.4};{:.1}",
            f64::from(n) * 0.1,
            0.24,
            0.02 * (f64::from(n) * 0.05).cos(),
            3000.0
        )?;
    }
    let mapping = Mapping::parse(&["u_v=CH1*100", "i_a=CH2*100", "omega_rad_s=Speed"])?;
    let recording = load(file.path(), &mapping, &Context::quiet())?;
    let voltage = recording.channel(Channel::Voltage).ok_or("no voltage")?;
    let speed = recording.channel(Channel::Speed).ok_or("no speed")?;
    println!(
        "{} samples every {} s: {} V, {:.2} rad/s",
        recording.len(),
        recording.sample_time_s(),
        voltage[0],
        speed[0]
    );
    assert!((voltage[0] - 24.0).abs() < 1e-9);
    assert!((speed[0] - 314.159).abs() < 1e-2);
    Ok(())
}
