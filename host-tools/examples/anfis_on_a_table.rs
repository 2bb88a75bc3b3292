//! A fuzzy network fitted to any table: `cargo run --release -p greyrig-host --example anfis_on_a_table`.

use greyrig_host::anfis::{Method, Settings, Table, train};
use greyrig_host::context::Context;

/// Runs the example.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    // z = sin x · cos y on a grid, and between its points to check.
    let grid = |offset: f64| {
        let places = (0..20).map(move |n| (f64::from(n) + offset) / 20.0 * 3.0);
        places.clone().flat_map(move |x| places.clone().map(move |y| ([x, y], x.sin() * y.cos())))
    };
    let table = Table::collect(2, grid(0.0))?;
    let check = Table::collect(2, grid(0.4))?;

    let trained = train(&table, Some(&check), &Settings::new(Method::Varpro, 3, 20), &Context::quiet())?;
    println!("RMS error {:.2e}, of the check {:.2e}", trained.rmse_trn, trained.rmse_chk.unwrap_or(f64::NAN));
    assert!(trained.rmse_chk.is_some_and(|error| error < 0.01));
    Ok(())
}
