//! The clock tree.

use embassy_stm32::Config;
use embassy_stm32::rcc::{Hse, HseMode, Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk, mux};
use embassy_stm32::time::Hertz;

/// The crystal X3 of the board (UM2505), Hz.
const CRYSTAL_HZ: u32 = 24_000_000;

/// Clock of the processor and of the timers: 24/6 · 85/2 MHz.
pub const CLOCK_HZ: u32 = CRYSTAL_HZ / 6 * 85 / 2;

/// 170 MHz for the processor, the timers and, divided by four within it, the converter: 42.5 MHz, of 60 MHz allowed
/// (data sheet DS12288, ADC characteristics). Range 1 boost mode and four wait states go with it (RM0440, section
/// 6.1.5).
pub fn config() -> Config {
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hse = Some(Hse { freq: Hertz(CRYSTAL_HZ), mode: HseMode::Oscillator });
    rcc.pll = Some(Pll {
        source: PllSource::HSE,
        prediv: PllPreDiv::DIV6,
        mul: PllMul::MUL85,
        divp: None,
        divq: None,
        divr: Some(PllRDiv::DIV2),
    });
    rcc.sys = Sysclk::PLL1_R;
    rcc.boost = true;
    rcc.mux.adc12sel = mux::Adcsel::SYS;
    config
}
