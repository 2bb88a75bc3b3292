//! Bus, peripherals and virtual time.
//!
//! Time is counted in cycles of the processor. An instruction takes [`Pace`] of them; a sleeping processor none.
//! Peripherals are told that time has passed when the first of them wants to be, and before each access to a register.

use crate::analog::Analog;
use crate::exceptions::{EXTERNAL, Exceptions, NMI, SYS_TICK};
use crate::fault::{Fault, Trouble};
use crate::peripherals::NEVER;
use crate::peripherals::adc::{Adc, Clocks};
use crate::peripherals::advanced::Advanced;
use crate::peripherals::comparator::{Comparators, Thresholds};
use crate::peripherals::dbgmcu::Dbgmcu;
use crate::peripherals::dma::{Dma, MULTIPLEXER, USART2_RX, USART2_TX};
use crate::peripherals::flash::{BANK_2, Contents, Flash};
use crate::peripherals::gpio::{Mode, Port};
use crate::peripherals::iwdg::Iwdg;
use crate::peripherals::pwr::Pwr;
use crate::peripherals::rcc::{Rcc, Reset};
use crate::peripherals::syscfg::Syscfg;
use crate::peripherals::system::{System, Wish};
use crate::peripherals::timer::Timer;
use crate::peripherals::usart::Usart;

/// Cycles per instruction, in 256ths: 256 counts instructions, more is a pessimistic processor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pace(pub u32);

impl Pace {
    /// A cycle per instruction: what is counted is instructions.
    pub const ONE: Self = Self(256);

    /// So many cycles per instruction, to a 256th.
    pub fn new(cycles: f64) -> Self {
        Self((256.0 * cycles).round().clamp(1.0, 65_535.0) as u32)
    }
}

/// Memory as the DMA sees it.
pub trait Memory {
    /// A byte; none where there is no memory.
    fn load(&self, address: u32) -> Option<u8>;
    /// Whether there was memory to write to.
    fn store(&mut self, address: u32, byte: u8) -> bool;
}

/// The identity of this chip (RM0440, section 48.1): 96 bits.
const UID: [u32; 3] = [0x0047_0031, 0x5242_5004, 0x2033_3756];

/// The station's contacts and wires, as somebody turns them (docs/wiring.md).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wires {
    /// START is pressed.
    pub start: bool,
    /// ABORT is pressed.
    pub abort: bool,
    /// The emergency stop is pressed; it opens the contactor by itself.
    pub emergency: bool,
    /// The wire of its feedback is broken.
    pub feedback_broken: bool,
}

/// Inputs of the station: port and pin of START (PC7), ABORT (PA6), the emergency stop's feedback (PB0).
const CONTACTS: [(usize, u32); 3] = [(2, 7), (0, 6), (1, 0)];
/// TIM1's function on PA9 and PA10.
const TIM1_OUTPUT: Mode = Mode::Alternate(6);
/// The converter's input of the current, PA1; a wire leads it to PA7, too.
const CURRENT: u8 = 2;

/// Interrupts (RM0440, vector table).
mod irq {
    pub const FLASH: usize = 4;
    pub const DMA1_CH1: usize = 11;
    pub const ADC1_2: usize = 18;
    pub const TIM15: usize = 24;
    pub const TIM2: usize = 28;
    pub const USART2: usize = 38;
    pub const DMA1_CH8: usize = 96;
}

/// Everything but processor and memory.
#[derive(Debug, Clone)]
pub struct Machine {
    /// Cycles since power came.
    pub now: u64,
    fraction: u32,
    pace: Pace,
    /// When a peripheral wants to be told that time has passed, or the run ends.
    pub next: u64,
    /// When the run ends.
    pub limit: u64,
    /// Pending and active exceptions.
    pub exceptions: Exceptions,
    /// The processor's own registers.
    pub system: System,
    /// Clocks and the cause of the last reset.
    pub rcc: Rcc,
    pwr: Pwr,
    /// The flash.
    pub flash: Flash,
    /// What a debugger has asked for.
    pub dbgmcu: Dbgmcu,
    syscfg: Syscfg,
    /// Ports A to G.
    pub ports: [Port; 7],
    tim1: Advanced,
    comparators: Comparators,
    thresholds: Thresholds,
    wires: Wires,
    tim2: Timer,
    tim5: Timer,
    tim15: Timer,
    /// The converter.
    pub adc: Adc,
    /// The line to the host.
    pub usart2: Usart,
    dma1: Dma,
    iwdg: Iwdg,
    /// Begin of the block that runs.
    pub pc: u32,
    /// The first thing that went wrong.
    pub fault: Option<Fault>,
    /// A reset is due.
    pub reset: Option<Reset>,
    /// The event register (ARMv7-M ARM, section B1.5.18).
    pub event: bool,
    /// The trigger of the converter has come off (a test's doing).
    pub trigger_cut: bool,
    /// Resets since power came.
    pub resets: u32,
    /// The longest time from the end of a sequence to the begin of its interrupt's handler since the reset, cycles.
    pub latest: u64,
}

impl Machine {
    /// Power comes.
    pub fn new(pace: Pace, contents: Contents) -> Self {
        let mut machine = Self {
            now: 0,
            fraction: 0,
            pace,
            next: 0,
            limit: NEVER,
            exceptions: Exceptions::default(),
            system: System::default(),
            rcc: Rcc::new(Reset::Power),
            pwr: Pwr::default(),
            flash: Flash::new(contents),
            dbgmcu: Dbgmcu::default(),
            syscfg: Syscfg::default(),
            ports: std::array::from_fn(Port::new),
            tim1: Advanced::default(),
            comparators: Comparators::default(),
            thresholds: Thresholds::default(),
            wires: Wires { start: false, abort: false, emergency: false, feedback_broken: false },
            tim2: Timer::tim2(),
            tim5: Timer::tim5(),
            tim15: Timer::tim15(),
            adc: Adc::default(),
            usart2: Usart::default(),
            dma1: Dma::default(),
            iwdg: Iwdg::default(),
            pc: 0,
            fault: None,
            reset: None,
            event: false,
            trigger_cut: false,
            resets: 0,
            latest: 0,
        };
        machine.turn(machine.wires);
        machine
    }

    /// A reset: everything begins anew but time, flash, the line and what a debugger has asked for (DBGMCU is reset by
    /// power only).
    pub fn restart(&mut self, reset: Reset) {
        let flash = self.flash.cut(|| 2);
        let line = std::mem::take(&mut self.usart2).reset();
        let Self { now, fraction, limit, trigger_cut, resets, wires, .. } = *self;
        let dbgmcu = self.dbgmcu.clone();
        *self = Self {
            now,
            fraction,
            limit,
            trigger_cut,
            resets: resets + 1,
            rcc: Rcc::new(reset),
            dbgmcu,
            usart2: line,
            ..Self::new(self.pace, flash)
        };
        self.turn(wires);
    }

    /// Somebody turns contacts or breaks wires.
    pub fn turn(&mut self, wires: Wires) {
        self.wires = wires;
        let levels = [wires.start, !wires.abort, !(wires.emergency || wires.feedback_broken)];
        for ((port, pin), level) in CONTACTS.into_iter().zip(levels) {
            let levels = &mut self.ports[port].levels;
            *levels = *levels & !(1 << pin) | u32::from(level) << pin;
        }
    }

    /// The contacts and wires as they are.
    pub fn wires(&self) -> Wires {
        self.wires
    }

    /// What the supply gets: whether its contactor is closed, and its voltage as a share of what it gives. The
    /// emergency stop is in series with the contactor's coil.
    pub fn supply(&self) -> (bool, f64) {
        let output = |channel, pin| if self.ports[0].mode(pin) == TIM1_OUTPUT { self.tim1.duty(channel) } else { 0.0 };
        (output(3, 10) == 1.0 && !self.wires.emergency, output(2, 9))
    }

    /// A word of bank 1, the program's own, cannot be read (its reads are not modelled): ECCD with its offset, and the
    /// non-maskable interrupt.
    pub fn spoil_program(&mut self, offset: u32) {
        self.flash.meet_unreadable(offset);
        self.exceptions.pend(NMI);
        self.next = 0;
    }

    /// Instructions have been executed.
    #[inline]
    pub fn spend(&mut self, instructions: u32) {
        let cost = instructions * self.pace.0 + self.fraction;
        self.now += u64::from(cost >> 8);
        self.fraction = cost & 0xFF;
    }

    /// The processor has slept until now; its cycle counter stands meanwhile, unless DBG_SLEEP keeps its clock on.
    pub fn sleep_until(&mut self, cycle: u64) {
        if cycle > self.now {
            if !self.dbgmcu.keeps_clocks_in_sleep() {
                self.system.stand_still(cycle - self.now);
            }
            self.now = cycle;
        }
    }

    /// Something has gone wrong; the first time counts.
    fn fail(&mut self, device: Device, address: u32, access: String, trouble: Trouble) {
        let (pc, peripheral) = (self.pc, device.name());
        self.fault.get_or_insert(match trouble {
            Trouble::Register => Fault::Register { peripheral, address, access, pc },
            Trouble::Use(what) => Fault::Use { peripheral, what, pc },
        });
        self.next = 0;
    }

    fn clocks(&self) -> Result<Clocks, Trouble> {
        Ok(Clocks { hclk_hz: self.rcc.hclk_hz(), adc_hz: self.rcc.adc12_hz()? })
    }

    /// Peripherals learn that time has passed, byte by byte and event by event, in their order.
    pub fn advance(&mut self, memory: &mut dyn Memory, analog: &mut dyn Analog) {
        loop {
            let due = self.first_event();
            if due > self.now {
                break;
            }
            self.pass(due, memory, analog);
            if self.fault.is_some() || self.reset.is_some() {
                break;
            }
        }
        // Counters are read at any time.
        self.tim2.advance(self.now);
        self.tim15.advance(self.now);
        self.settle(memory);
    }

    /// When the first peripheral has something to do.
    fn first_event(&self) -> u64 {
        self.tim2
            .next()
            .min(self.tim15.next())
            .min(self.adc.next())
            .min(self.usart2.next())
            .min(self.flash.next())
            .min(self.iwdg.deadline())
            .min(self.system.next())
    }

    fn pass(&mut self, now: u64, memory: &mut dyn Memory, analog: &mut dyn Analog) {
        self.tim2.advance(now);
        if let Some(at) = self.tim2.take_trigger()
            && !self.trigger_cut
        {
            self.tim5.clock(at);
            let pins = self.analog_pins();
            let (closed, fraction) = self.supply();
            analog.supply(closed, fraction);
            let done = self.clocks().and_then(|clocks| {
                pins?;
                self.adc.trigger(at, clocks, analog)
            });
            // The comparators see the current before the converter is done with it.
            if self.comparators.any_on()
                && let Some(counts) = analog.convert(CURRENT)
            {
                self.tim1.compare(self.comparators.outputs(counts, &self.thresholds));
            }
            if let Err(trouble) = done {
                self.fail(Device::Adc1, 0x5000_0000, String::new(), trouble);
            }
        }
        self.tim15.advance(now);
        // Nobody listens to this one.
        self.tim15.take_trigger();
        self.adc.advance(now);
        self.flash.advance(now);
        self.usart2.advance(now);
        if self.system.advance(now) {
            self.exceptions.pend(SYS_TICK);
        }
        if now >= self.iwdg.deadline() {
            self.reset = Some(Reset::Watchdog);
        }
        self.serve_dma(now, memory);
    }

    /// Inputs of the sequence have to be analog pins (RM0440, section 11.3.12).
    fn analog_pins(&self) -> Result<(), Trouble> {
        for input in self.adc.inputs() {
            let (port, pin) = match input {
                1..=4 => (0, u32::from(input) - 1),
                6..=9 => (2, u32::from(input) - 6),
                _ => continue,
            };
            if self.ports[port].mode(pin) != Mode::Analog {
                return Err(Trouble::used(format!("the pin of input {input} is not analog")));
            }
        }
        Ok(())
    }

    fn serve_dma(&mut self, now: u64, memory: &mut dyn Memory) {
        while self.usart2.wants_read()
            && let Some(transfer) = self.dma1.serve(USART2_RX)
        {
            let byte = self.usart2.take();
            if !memory.store(transfer.memory, byte) {
                self.fail(Device::Dma1, transfer.memory, String::new(), Trouble::used("it writes where no memory is"));
                return;
            }
            self.dma1.complete(transfer);
        }
        while self.usart2.wants_write()
            && let Some(transfer) = self.dma1.serve(USART2_TX)
        {
            let Some(byte) = memory.load(transfer.memory) else {
                self.fail(Device::Dma1, transfer.memory, String::new(), Trouble::used("it reads where no memory is"));
                return;
            };
            self.usart2.put(byte, now);
            self.dma1.complete(transfer);
        }
    }

    /// After anything has changed: requests to the DMA, lines of interrupts, the next event.
    fn settle(&mut self, memory: &mut dyn Memory) {
        self.serve_dma(self.now, memory);
        let before = self.exceptions.any_pending();
        self.exceptions.line(irq::FLASH, self.flash.interrupts());
        for channel in 0..7 {
            self.exceptions.line(irq::DMA1_CH1 + channel, self.dma1.interrupts(channel));
        }
        self.exceptions.line(irq::DMA1_CH8, self.dma1.interrupts(7));
        self.exceptions.line(irq::ADC1_2, self.adc.interrupts());
        self.exceptions.line(irq::TIM15, self.tim15.interrupts());
        self.exceptions.line(irq::TIM2, self.tim2.interrupts());
        self.exceptions.line(irq::USART2, self.usart2.interrupts());
        self.event |= self.system.event_on_pending && !before && self.exceptions.any_pending();
        self.plan();
    }

    /// A handler has been entered.
    pub fn entered(&mut self, number: usize) {
        self.exceptions.enter(number);
        if number == EXTERNAL + irq::ADC1_2 {
            self.latest = self.latest.max(self.now - self.adc.ended());
        }
    }

    /// The host has sent something.
    pub fn receive(&mut self, bytes: &[u8]) {
        self.usart2.from_host.extend(bytes);
        self.usart2.look_at_line(self.now);
        self.plan();
    }

    fn plan(&mut self) {
        let at_once = self.fault.is_some() || self.reset.is_some();
        self.next = if at_once { 0 } else { self.first_event().min(self.limit) };
    }

    /// Whether the program must not go on: the end of the run, a reset, a fault.
    pub fn is_over(&self) -> bool {
        self.now >= self.limit || self.reset.is_some() || self.fault.is_some()
    }

    /// Recomputes when the run has to be interrupted.
    pub fn set_limit(&mut self, limit: u64) {
        self.limit = limit;
        self.plan();
    }

    /// A read by the processor.
    pub fn read(&mut self, address: u32, bytes: usize, memory: &mut dyn Memory, analog: &mut dyn Analog) -> u32 {
        if self.now >= self.next {
            self.advance(memory, analog);
        }
        if let 0x4000_0000..0x4000_0400 | 0x4001_4000..0x4001_4400 = address {
            self.tim2.advance(self.now);
            self.tim15.advance(self.now);
        }
        if let BANK_2..0x0808_0000 = address {
            return match self.flash.read_bank((address - BANK_2) as usize, bytes) {
                Ok((value, unreadable)) => {
                    if unreadable {
                        self.exceptions.pend(NMI);
                    }
                    value
                }
                Err(trouble) => {
                    self.fail(Device::Flash, address, String::new(), trouble);
                    0
                }
            };
        }
        let (word, shift) = (address & !3, 8 * (address & 3));
        let (device, answer) = self.read_word(word);
        match answer {
            Ok(value) => {
                let value = value >> shift;
                // Reading RDR has a consequence.
                if word == 0x4000_4424 {
                    self.settle(memory);
                }
                if bytes == 4 { value } else { value & ((1 << (8 * bytes)) - 1) }
            }
            Err(trouble) => {
                self.fail(device, address, format!("read of {bytes} bytes"), trouble);
                0
            }
        }
    }

    fn read_word(&mut self, address: u32) -> (Device, Result<u32, Trouble>) {
        let (device, base) = place(address);
        let offset = address - base;
        if !self.rcc.enabled(base) {
            return (device, Err(Trouble::used(format!("{address:#010x} is read while its clock is off"))));
        }
        let answer = match device {
            Device::Tim1 => self.tim1.read(offset),
            Device::Comp => self.comparators.read(offset),
            Device::Dac3 => self.thresholds.read(offset),
            Device::Tim2 => self.tim2.read(offset),
            Device::Tim5 => self.tim5.read(offset),
            Device::Iwdg => self.iwdg.read(offset),
            Device::Usart2 => self.usart2.read(offset),
            Device::Pwr => self.pwr.read(offset),
            Device::Syscfg => self.syscfg.read(offset),
            Device::Tim15 => self.tim15.read(offset),
            Device::Dma1 => self.dma1.read(offset),
            Device::Dmamux1 => self.dma1.read(MULTIPLEXER + offset),
            Device::Rcc => self.rcc.read(offset),
            Device::Flash => self.flash.read(offset),
            Device::Gpio => self.ports[((base - 0x4800_0000) / 0x400) as usize].read(offset),
            Device::Adc1 => self.adc.read(offset),
            Device::Dbgmcu => self.dbgmcu.read(offset),
            Device::Processor => self.system.read(offset, self.now, &self.exceptions, 0),
            Device::Uid => UID.get(offset as usize / 4).copied().ok_or(Trouble::Register),
            _ => Err(Trouble::Register),
        };
        (device, answer)
    }

    /// A write by the processor.
    pub fn write(&mut self, address: u32, bytes: usize, value: u32, memory: &mut dyn Memory, analog: &mut dyn Analog) {
        self.advance(memory, analog);
        let hclk_hz = self.rcc.hclk_hz();
        let (device, answer) = if let BANK_2..0x0808_0000 = address {
            let offset = (address - BANK_2) as usize;
            (Device::Flash, self.flash.write_bank(offset, bytes, value, self.now, hclk_hz))
        } else {
            self.write_word(address, bytes, value)
        };
        if let Err(trouble) = answer {
            self.fail(device, address, format!("write of {value:#x}, {bytes} bytes"), trouble);
        }
        // An update event that the program made triggers, too.
        self.advance(memory, analog);
    }

    fn write_word(&mut self, address: u32, bytes: usize, value: u32) -> (Device, Result<(), Trouble>) {
        let (device, base) = place(address);
        let (offset, now, hclk_hz) = (address - base, self.now, self.rcc.hclk_hz());
        if !self.rcc.enabled(base) {
            return (device, Err(Trouble::used(format!("{address:#010x} is written while its clock is off"))));
        }
        // Half words: timers (section 29.5) and the data registers of the USART (section 37.8.12).
        let narrow = matches!(device, Device::Tim1 | Device::Tim2 | Device::Tim5 | Device::Tim15 | Device::Usart2)
            && address.is_multiple_of(4);
        if device != Device::Processor && !narrow && (bytes != 4 || !address.is_multiple_of(4)) {
            return (device, Err(Trouble::used(format!("{bytes} bytes are written to {address:#010x}"))));
        }
        let answer = match device {
            Device::Tim1 => self.tim1.write(offset, value),
            Device::Comp => self.comparators.write(offset, value),
            Device::Dac3 => self.thresholds.write(offset, value),
            Device::Tim2 => self.tim2.write(offset, value, now),
            Device::Tim5 => self.tim5.write(offset, value, now),
            Device::Iwdg => self.iwdg.write(offset, value, now, hclk_hz),
            Device::Usart2 => self.usart2.write(offset, value, now),
            Device::Pwr => self.pwr.write(offset, value),
            Device::Syscfg => self.syscfg.write(offset, value),
            Device::Tim15 => self.tim15.write(offset, value, now),
            Device::Dma1 => self.dma1.write(offset, value),
            Device::Dmamux1 => self.dma1.write(MULTIPLEXER + offset, value),
            Device::Rcc => self.rcc.write(offset, value).and_then(|()| self.enough_wait_states()),
            Device::Flash => self.flash.write(offset, value, now, hclk_hz),
            Device::Gpio => self.ports[((base - 0x4800_0000) / 0x400) as usize].write(offset, value),
            Device::Adc1 => self.clocks().and_then(|clocks| self.adc.write(offset, value, now, clocks)),
            Device::Dbgmcu => self.dbgmcu.write(offset, value),
            Device::Processor => self.system.write(offset, bytes, value, now, &mut self.exceptions).map(|wish| {
                if wish == Wish::Reset {
                    self.reset = Some(Reset::Software);
                }
            }),
            _ => Err(Trouble::Register),
        };
        (device, answer)
    }

    /// A wait state for each 34 MHz in range 1 boost mode (RM0440, section 3.3.3).
    fn enough_wait_states(&self) -> Result<(), Trouble> {
        let needed = (self.rcc.hclk_hz() - 1) / 34_000_000;
        if self.flash.wait_states() >= needed {
            return Ok(());
        }
        Err(Trouble::used(format!("{} Hz need {needed} wait states of the flash", self.rcc.hclk_hz())))
    }
}

/// A peripheral.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Device {
    Uid,
    Tim1,
    Comp,
    Dac3,
    Tim2,
    Tim5,
    Iwdg,
    Usart2,
    Pwr,
    Syscfg,
    Tim15,
    Dma1,
    Dmamux1,
    Rcc,
    Flash,
    Gpio,
    Adc1,
    Dbgmcu,
    Processor,
    Nothing,
}

impl Device {
    /// As the reference manual calls it.
    const fn name(self) -> &'static str {
        match self {
            Self::Uid => "UID",
            Self::Tim1 => "TIM1",
            Self::Comp => "COMP",
            Self::Dac3 => "DAC3",
            Self::Tim2 => "TIM2",
            Self::Tim5 => "TIM5",
            Self::Iwdg => "IWDG",
            Self::Usart2 => "USART2",
            Self::Pwr => "PWR",
            Self::Syscfg => "SYSCFG",
            Self::Tim15 => "TIM15",
            Self::Dma1 => "DMA1",
            Self::Dmamux1 => "DMAMUX1",
            Self::Rcc => "RCC",
            Self::Flash => "FLASH",
            Self::Gpio => "GPIO",
            Self::Adc1 => "ADC1",
            Self::Dbgmcu => "DBGMCU",
            Self::Processor => "processor",
            Self::Nothing => "no peripheral",
        }
    }
}

/// The peripheral at an address, and its first address (RM0440, memory map).
fn place(address: u32) -> (Device, u32) {
    match address {
        0x1FFF_7590..0x1FFF_759C => (Device::Uid, 0x1FFF_7590),
        0x4000_0000..0x4000_0400 => (Device::Tim2, 0x4000_0000),
        0x4000_0C00..0x4000_1000 => (Device::Tim5, 0x4000_0C00),
        0x4000_3000..0x4000_3400 => (Device::Iwdg, 0x4000_3000),
        0x4000_4400..0x4000_4800 => (Device::Usart2, 0x4000_4400),
        0x4000_7000..0x4000_7400 => (Device::Pwr, 0x4000_7000),
        0x4001_0000..0x4001_0030 => (Device::Syscfg, 0x4001_0000),
        0x4001_0200..0x4001_0208 => (Device::Comp, 0x4001_0200),
        0x4001_2C00..0x4001_3000 => (Device::Tim1, 0x4001_2C00),
        0x4001_4000..0x4001_4400 => (Device::Tim15, 0x4001_4000),
        0x4002_0000..0x4002_0400 => (Device::Dma1, 0x4002_0000),
        // The multiplexer's first eight channels are those of DMA1.
        0x4002_0800..0x4002_0820 => (Device::Dmamux1, 0x4002_0800),
        0x4002_1000..0x4002_1400 => (Device::Rcc, 0x4002_1000),
        0x4002_2000..0x4002_2400 => (Device::Flash, 0x4002_2000),
        0x4800_0000..0x4800_1C00 => (Device::Gpio, address & !0x3FF),
        0x5000_0000..0x5000_0100 | 0x5000_0300..0x5000_0400 => (Device::Adc1, 0x5000_0000),
        0x5000_1000..0x5000_1400 => (Device::Dac3, 0x5000_1000),
        0xE004_2000..0xE004_2400 => (Device::Dbgmcu, 0xE004_2000),
        0xE000_0000..0xE001_0000 => (Device::Processor, 0xE000_0000),
        _ => (Device::Nothing, address & !0x3FF),
    }
}
