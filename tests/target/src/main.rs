//! The core on an emulated Cortex-M4F: prints the bits of every scenario and the instructions of what is counted.
//! The test `host_equals_target` builds it, runs it and reads what it prints.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    println!("This program is for the emulated board; run it by");
    println!("cargo test --release --package greyrig-target-tests -- --nocapture");
}

#[cfg(target_os = "none")]
mod on_target {
    // The macro below makes the reset handler's `main`, an exported symbol.
    #![allow(unsafe_code)]

    use core::fmt::Write;
    use core::hint::black_box;
    use core::panic::PanicInfo;

    use cortex_m::peripheral::syst::SystClkSource;
    use cortex_m::peripheral::{Peripherals, SYST};
    use cortex_m_semihosting::{debug, hio, hprintln};
    use greyrig_target_tests::counted::{self, Counter};

    /// SysTick counts at 25 MHz, and `-icount shift=10` makes an instruction last 2^10 ns: 25.6 ticks.
    const TICKS_IN_TEN_INSTRUCTIONS: u32 = 256;
    /// The 24 bits of SysTick.
    const TICKS: u32 = 1 << 24;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        debug::exit(match run() {
            Some(()) => debug::EXIT_SUCCESS,
            None => debug::EXIT_FAILURE,
        });
        loop {
            cortex_m::asm::wfi();
        }
    }

    fn run() -> Option<()> {
        let mut out = hio::hstdout().ok()?;
        greyrig_target_tests::write_bits(&mut out).ok()?;
        let mut counter = SysTick::new(Peripherals::take()?.SYST);
        counter.count("self_test_100_nops", (), |()| nops::<100>());
        counter.count("self_test_3_nops", (), |()| nops::<3>());
        counted::all(&mut counter);
        out.write_str("done\n").ok()
    }

    /// Instructions by the system timer.
    struct SysTick {
        /// What a measurement of nothing shows: the call, and reading the timer.
        empty: u32,
    }

    impl SysTick {
        fn new(mut timer: SYST) -> Self {
            timer.set_clock_source(SystClkSource::Core);
            timer.set_reload(TICKS - 1);
            timer.clear_current();
            timer.enable_counter();
            // A call of nothing at all would be optimised away.
            let empty = instructions(&mut (), &mut |()| nops::<1>()) - 1;
            Self { empty }
        }
    }

    impl Counter for SysTick {
        fn count_runs<S>(
            &mut self,
            name: &str,
            runs: usize,
            mut state: S,
            mut ready: impl FnMut(&mut S),
            mut run: impl FnMut(&mut S),
        ) {
            let (mut least, mut most) = (u32::MAX, 0);
            for _ in 0..runs {
                ready(&mut state);
                let count = instructions(&mut state, &mut run) - self.empty;
                (least, most) = (least.min(count), most.max(count));
            }
            if least == most {
                hprintln!("count {name} {most}");
            } else {
                hprintln!("count {name} {most} least {least}");
            }
        }
    }

    /// Instructions from one reading of the timer to the next. The timer counts down.
    #[inline(never)]
    fn instructions<S>(state: &mut S, run: &mut impl FnMut(&mut S)) -> u32 {
        let start = SYST::get_current();
        called(black_box(state), run);
        let end = SYST::get_current();
        // Nearest: a reading is off by less than a tick.
        ((start.wrapping_sub(end) % TICKS) * 10 + TICKS_IN_TEN_INSTRUCTIONS / 2) / TICKS_IN_TEN_INSTRUCTIONS
    }

    /// A call, whatever the optimiser thinks of it, so that the empty one costs the same.
    #[inline(never)]
    fn called<S>(state: &mut S, run: &mut impl FnMut(&mut S)) {
        run(state);
    }

    #[inline(always)]
    fn nops<const N: usize>() {
        // Unrolled by the compiler: a loop would add its own instructions.
        let _ = [(); N].map(|()| cortex_m::asm::nop());
    }

    #[panic_handler]
    fn panic(info: &PanicInfo) -> ! {
        hprintln!("{info}");
        debug::exit(debug::EXIT_FAILURE);
        loop {
            cortex_m::asm::wfi();
        }
    }
}
