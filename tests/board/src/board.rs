//! The board: processor, machine, power, pins and the line to the host.

use std::cell::{Ref, RefMut};

use unicorn_engine::RegisterARM;

use crate::analog::Analog;
use crate::fault::Fault;
use crate::image::Image;
use crate::machine::{Machine, Pace, Wires};
use crate::peripherals::flash::Contents;
use crate::peripherals::rcc::Reset;
use crate::processor::{Processor, RAM, State};

/// Clock of the processor once the firmware has set it up, Hz; virtual time is counted in its cycles.
pub const CLOCK_HZ: u64 = 170_000_000;

/// A board under power.
pub struct Board {
    processor: Processor,
    pace: Pace,
}

/// A moment of a board, to go back to. What stands at the converter's pins is not part of it.
pub struct Moment {
    state: State,
    machine: Machine,
}

impl Board {
    /// Power comes, with an image in bank 1 and these contents of bank 2.
    ///
    /// # Errors
    /// An image that does not fit.
    pub fn new(image: &Image, contents: Contents, analog: Box<dyn Analog>, pace: Pace) -> Result<Self, Fault> {
        let mut processor = Processor::new(image, Machine::new(pace, contents), analog)?;
        processor.power_up()?;
        Ok(Self { processor, pace })
    }

    /// The machine.
    pub fn machine(&self) -> Ref<'_, Machine> {
        Ref::map(self.processor.shared().borrow(), |shared| &shared.machine)
    }

    /// The machine.
    pub fn machine_mut(&mut self) -> RefMut<'_, Machine> {
        RefMut::map(self.processor.shared().borrow_mut(), |shared| &mut shared.machine)
    }

    /// Virtual time since the first power, s.
    pub fn seconds(&self) -> f64 {
        self.machine().now as f64 / CLOCK_HZ as f64
    }

    /// Runs for so many seconds of virtual time.
    ///
    /// # Errors
    /// What the model does not have, or the chip would not survive.
    pub fn run(&mut self, seconds: f64) -> Result<(), Fault> {
        let until = self.machine().now + (seconds * CLOCK_HZ as f64) as u64;
        self.run_until(until)
    }

    /// Runs until a cycle.
    ///
    /// # Errors
    /// As [`Board::run`].
    pub fn run_until(&mut self, cycle: u64) -> Result<(), Fault> {
        self.processor.run(cycle)
    }

    /// The host sends bytes.
    pub fn send(&mut self, bytes: &[u8]) {
        self.machine_mut().receive(bytes);
    }

    /// What the board has sent since the last call.
    pub fn receive(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.machine_mut().usart2.to_host)
    }

    /// Whether a pin is driven high, by its name, such as `PB10`.
    pub fn is_high(&self, pin: &str) -> bool {
        let port = pin.as_bytes().get(1).map(|letter| usize::from(letter.wrapping_sub(b'A')));
        let number = pin.get(2..).and_then(|number| number.parse().ok());
        match (port, number) {
            (Some(port), Some(number)) => self.machine().ports.get(port).is_some_and(|port| port.is_high(number)),
            _ => false,
        }
    }

    /// Somebody turns a contact of the station, or breaks a wire.
    pub fn turn(&mut self, turn: impl FnOnce(&mut Wires)) {
        let mut machine = self.machine_mut();
        let mut wires = machine.wires();
        turn(&mut wires);
        machine.turn(wires);
    }

    /// What the supply gets: whether its contactor is closed, and its voltage as a share of what it gives.
    pub fn supply(&self) -> (bool, f64) {
        self.machine().supply()
    }

    /// A word of flash's bank 1, RAM or CCM-SRAM; none where there is no memory.
    pub fn word(&self, address: u32) -> Option<u32> {
        self.processor.word(address)
    }

    /// The reset button.
    pub fn press_reset(&mut self) {
        self.machine_mut().reset = Some(Reset::Pin);
    }

    /// Something else stands at the converter's pins from now on.
    pub fn connect(&mut self, analog: Box<dyn Analog>) {
        self.processor.shared().borrow_mut().analog = analog;
    }

    /// The power goes in this moment, and comes again. What was being written to the flash is left to chance.
    ///
    /// # Errors
    /// The emulator's.
    pub fn cut_power(&mut self, chance: impl FnMut() -> u32) -> Result<(), Fault> {
        {
            let pace = self.pace;
            let mut machine = self.machine_mut();
            let (contents, wires) = (machine.flash.cut(chance), machine.wires());
            *machine = Machine::new(pace, contents);
            machine.turn(wires);
        }
        self.processor.power_up()
    }

    /// The supply dips: a reset by brown-out, after which memory is as it was.
    ///
    /// # Errors
    /// The emulator's.
    pub fn dip_supply(&mut self, chance: impl FnMut() -> u32) -> Result<(), Fault> {
        {
            let pace = self.pace;
            let mut machine = self.machine_mut();
            let (contents, wires) = (machine.flash.cut(chance), machine.wires());
            *machine = Machine::new(pace, contents);
            machine.turn(wires);
        }
        self.processor.dip()
    }

    /// The program jumps to where no instruction is; gives the address.
    pub fn jump_astray(&mut self) -> u32 {
        // UDF, at the end of bank 1.
        const PLACE: u32 = 0x0803_FFF0;
        self.processor.set_word(PLACE, 0xDE00_DE00);
        self.processor.divert(RegisterARM::PC, PLACE | 1);
        PLACE
    }

    /// The stack is as deep as it can be.
    pub fn exhaust_stack(&mut self) {
        self.processor.divert(RegisterARM::SP, RAM + 8);
    }

    /// Keeps this moment.
    ///
    /// # Errors
    /// The emulator's.
    pub fn moment(&self) -> Result<Moment, Fault> {
        Ok(Moment { state: self.processor.save()?, machine: self.machine().clone() })
    }

    /// Goes back.
    ///
    /// # Errors
    /// The emulator's.
    pub fn go_back(&mut self, moment: &Moment) -> Result<(), Fault> {
        self.processor.restore(&moment.state)?;
        *self.machine_mut() = moment.machine.clone();
        Ok(())
    }
}
