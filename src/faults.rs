//! What can go wrong on the rig: a number, a name, words, and what to do about it.
//!
//! Numbers come in ranges, and are never used again for anything else: 1 … 9 parameters, 10 … 19 sampling, 20 … 29 the
//! measured signals, 30 … 39 the link, 40 … 49 flash and processor.

/// A fault. The discriminant is its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
pub enum Fault {
    /// No valid block of parameters.
    NotConfigured = 1,
    /// A block that is whole but that this program cannot use.
    ParametersRefused = 2,
    /// A tick was not done when the next sample had come and gone.
    TickOverrun = 10,
    /// Raw samples were lost because the link did not take them in time.
    CaptureLost = 11,
    /// Telemetry was lost because the link did not take it in time.
    TelemetryLost = 12,
    /// Samples and the time driver disagree.
    TimeBase = 13,
    /// The voltage is at the end of the converter's range.
    VoltageClipped = 20,
    /// The current is.
    CurrentClipped = 21,
    /// The speed is.
    SpeedClipped = 22,
    /// The current does not move although the voltage does.
    CurrentFrozen = 23,
    /// The speed jumps further than a rotor can.
    SpeedJump = 24,
    /// Bytes on the link that were no frame.
    BadFrame = 30,
    /// A frame that was no request.
    BadRequest = 31,
    /// A block could not be written.
    FlashWrite = 40,
    /// A word of the flash cannot be read.
    FlashUnreadable = 41,
    /// The watchdog has restarted the processor.
    WatchdogReset = 42,
    /// The program has come to an end by itself, or the supply has.
    Incident = 43,
    /// Too many ends in a row.
    HeldBack = 44,
}

/// A fault in words.
#[derive(Debug, Clone, Copy)]
pub struct Description {
    /// The fault.
    pub fault: Fault,
    /// What has happened.
    pub what: &'static str,
    /// What to do about it.
    pub remedy: &'static str,
}

/// All faults, by rising numbers.
pub const TABLE: [Description; 18] = [
    Description {
        fault: Fault::NotConfigured,
        what: "no valid parameters in flash: safe mode, the model does not run",
        remedy: "write them with `greyrig flash`",
    },
    Description {
        fault: Fault::ParametersRefused,
        what: "the parameters in flash are whole, but this firmware cannot use them: safe mode",
        remedy: "write them with the greyrig that belongs to the firmware",
    },
    Description {
        fault: Fault::TickOverrun,
        what: "a tick took longer than the 100 µs between two samples, and a sample was not taken",
        remedy: "use fewer effects or shorter terms; a recording marks the sample as invalid",
    },
    Description {
        fault: Fault::CaptureLost,
        what: "raw samples were lost because the link did not take them in time",
        remedy: "connect the port to nothing else, use a shorter cable, and record again; the samples are numbered",
    },
    Description {
        fault: Fault::TelemetryLost,
        what: "telemetry was lost because the link did not take it in time",
        remedy: "connect the port to nothing else, and ask for fewer reports a second",
    },
    Description {
        fault: Fault::TimeBase,
        what: "within a second there were more or fewer samples than the time says: the sampling stood still or runs too slowly",
        remedy: "record or test again; if it comes again, check the trigger of the converter (TIM2, TIM5) and the crystal",
    },
    Description {
        fault: Fault::VoltageClipped,
        what: "the voltage channel is at the end of the converter's range",
        remedy: "lower the supply or the gain of the voltage amplifier, and calibrate again",
    },
    Description {
        fault: Fault::CurrentClipped,
        what: "the current channel is at the end of the converter's range",
        remedy: "start the motor at a lower voltage or lower the gain of the current sensor, and calibrate again",
    },
    Description {
        fault: Fault::SpeedClipped,
        what: "the speed channel is at the end of the converter's range",
        remedy: "lower the gain of the speed converter, and calibrate again",
    },
    Description {
        fault: Fault::CurrentFrozen,
        what: "the current has not moved by a count for 0.2 s while the voltage has by a tenth of its range",
        remedy: "check the motor's terminals and the wire and supply of the current sensor",
    },
    Description {
        fault: Fault::SpeedJump,
        what: "the speed has changed by a tenth of its range within 100 µs, which no rotor does",
        remedy: "check the wire and the pick-up of the speed",
    },
    Description {
        fault: Fault::BadFrame,
        what: "bytes on the link were no frame; they were ignored",
        remedy: "none if it happens once when the host connects; else check cable, earth and baud rate",
    },
    Description {
        fault: Fault::BadRequest,
        what: "a frame was whole but no request that this firmware knows",
        remedy: "use the greyrig that belongs to the firmware",
    },
    Description {
        fault: Fault::FlashWrite,
        what: "a block could not be written to flash; the one before it still counts",
        remedy: "write it again; if that fails, the flash is worn or protected (option bytes)",
    },
    Description {
        fault: Fault::FlashUnreadable,
        what: "a word of the flash could not be read: a power cut during writing",
        remedy: "write the parameters again if there are none; nothing else",
    },
    Description {
        fault: Fault::WatchdogReset,
        what: "the watchdog has restarted the processor because no tick was done for half a second",
        remedy: "check the trigger of the converter (TIM2) and report it with the firmware's version",
    },
    Description {
        fault: Fault::Incident,
        what: "the processor was started anew after a panic, a hard fault, a dip of the supply or an unreadable word of its program",
        remedy: "`greyrig rig` shows where; check the supply, flash the firmware again, or report it with what is shown",
    },
    Description {
        fault: Fault::HeldBack,
        what: "three starts in a row ended within ten seconds: safe mode, the parameters in flash are left alone",
        remedy: "`greyrig rig` shows the last end; write other parameters, or flash the firmware again",
    },
];

impl Fault {
    /// Its number.
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// Its place in [`TABLE`], and its bit in a set of faults.
    pub const fn place(self) -> usize {
        let mut place = 0;
        while place < TABLE.len() {
            if TABLE[place].fault as u8 == self as u8 {
                return place;
            }
            place += 1;
        }
        0
    }
}
