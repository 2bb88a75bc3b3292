//! The functions of FMI 2.0, for co-simulation.
//!
//! Source: Functional Mock-up Interface Specification 2.0.5, with its header files.
//!
//! # Safety
//! All functions: as [`importer`](crate::importer) says.
#![allow(non_snake_case, clippy::missing_safety_doc)]

use std::ffi::{c_char, c_int, c_void};

use crate::importer::{
    Component, Log, Log2, Status, free, free_state, get_state, put, read, set_state, text, with, write,
};
use crate::instance::{Instance, Phase, Saved};
use crate::resources;

type Fmi = *mut Component;
type Numbers = *const u32;

/// What a simulator lets itself be called by: `fmi2CallbackFunctions`.
#[repr(C)]
pub struct Callbacks {
    /// The log.
    pub logger: Option<Log2>,
    /// Not used: Rust has memory of its own.
    pub allocate_memory: *const c_void,
    /// Likewise.
    pub free_memory: *const c_void,
    /// Not used: no step goes on behind a call.
    pub step_finished: *const c_void,
    /// What the log wants to be given.
    pub environment: *mut c_void,
}

/// Of `fmi2Type`.
const CO_SIMULATION: c_int = 1;
/// Of `fmi2StatusKind`.
const LAST_SUCCESSFUL_TIME: c_int = 2;
/// Of `fmi2StatusKind`.
const TERMINATED: c_int = 3;

/// `fmi2GetTypesPlatform`.
// SAFETY: the name is the interface's; a simulator loads it from this library by its handle.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

/// `fmi2GetVersion`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

/// `fmi2SetDebugLogging`: errors are told in any case, and there is nothing else.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetDebugLogging(_: Fmi, _on: c_int, _count: usize, _categories: *const *const c_char) -> Status {
    Status::Ok
}

/// `fmi2Instantiate`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Instantiate(
    name: *const c_char,
    kind: c_int,
    guid: *const c_char,
    resource_location: *const c_char,
    callbacks: *const Callbacks,
    _visible: c_int,
    _logging_on: c_int,
) -> Fmi {
    // SAFETY: strings of the simulator.
    let [name, guid, location] = unsafe { [text(name), text(guid), text(resource_location)] };
    // SAFETY: null, or functions of the simulator.
    let log = unsafe { callbacks.as_ref() }
        .map_or(Log::Two(std::ptr::null_mut(), None), |callbacks| Log::Two(callbacks.environment, callbacks.logger));
    Component::give_out(&name, log, || {
        if kind != CO_SIMULATION {
            return Err("this unit has no model exchange".to_owned());
        }
        resources::read(&resources::folder(&location), &guid).map(Instance::new)
    })
}

/// `fmi2FreeInstance`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeInstance(instance: Fmi) {
    // SAFETY: an instance of the simulator, which is not used any more.
    unsafe { free(instance) }
}

/// `fmi2SetupExperiment`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetupExperiment(
    instance: Fmi,
    _tolerance_defined: c_int,
    _tolerance: f64,
    start_time: f64,
    _stop_time_defined: c_int,
    _stop_time: f64,
) -> Status {
    // SAFETY: an instance of the simulator.
    unsafe { with(instance, |instance| instance.start_at(start_time)) }
}

/// Functions that take the instance alone.
macro_rules! plain {
    ($($name:ident: $work:expr;)+) => {
        $(
            #[doc = concat!("`", stringify!($name), "`.")]
            // SAFETY: the name is the interface's.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $name(instance: Fmi) -> Status {
                // SAFETY: an instance of the simulator.
                unsafe { with(instance, $work) }
            }
        )+
    };
}

plain! {
    fmi2EnterInitializationMode: |instance| {
        let start = instance.time();
        instance.enter_initialization(start)
    };
    fmi2ExitInitializationMode: Instance::exit_initialization;
    fmi2Terminate: Instance::terminate;
    fmi2Reset: |instance| {
        instance.reset();
        Ok(())
    };
    fmi2CancelStep: |_| Err("no step goes on behind a call".to_owned());
}

/// `fmi2GetReal`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetReal(instance: Fmi, numbers: Numbers, count: usize, values: *mut f64) -> Status {
    // SAFETY: an instance and arrays of the simulator.
    unsafe { read(instance, [count, count], numbers, values) }
}

/// `fmi2SetReal`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetReal(instance: Fmi, numbers: Numbers, count: usize, values: *const f64) -> Status {
    // SAFETY: an instance and arrays of the simulator.
    unsafe { write(instance, [count, count], numbers, values) }
}

/// Functions of a type of which the unit has no variable: nothing can be asked of them.
macro_rules! of_type {
    ($($get:ident, $set:ident: $type:ty;)+) => {
        $(
            #[doc = concat!("`", stringify!($get), "`.")]
            // SAFETY: the name is the interface's.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $get(instance: Fmi, _: Numbers, count: usize, _: *mut $type) -> Status {
                // SAFETY: an instance of the simulator.
                unsafe { with(instance, |_| none_of(count)) }
            }
            #[doc = concat!("`", stringify!($set), "`.")]
            // SAFETY: the name is the interface's.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $set(instance: Fmi, _: Numbers, count: usize, _: *const $type) -> Status {
                // SAFETY: an instance of the simulator.
                unsafe { with(instance, |_| none_of(count)) }
            }
        )+
    };
}

fn none_of(count: usize) -> Result<(), String> {
    if count == 0 { Ok(()) } else { Err("the unit has variables of the type Real alone".to_owned()) }
}

of_type! {
    fmi2GetInteger, fmi2SetInteger: c_int;
    fmi2GetBoolean, fmi2SetBoolean: c_int;
    fmi2GetString, fmi2SetString: *const c_char;
}

/// `fmi2DoStep`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DoStep(instance: Fmi, time: f64, step: f64, _no_set_state_before: c_int) -> Status {
    // SAFETY: an instance of the simulator.
    unsafe { with(instance, |instance| instance.step(time, step)) }
}

/// `fmi2GetFMUstate`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetFMUstate(instance: Fmi, state: *mut *mut Saved) -> Status {
    // SAFETY: an instance of the simulator, and a state that is null or that this library has given out.
    unsafe { get_state(instance, state) }
}

/// `fmi2SetFMUstate`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetFMUstate(instance: Fmi, state: *mut Saved) -> Status {
    // SAFETY: an instance of the simulator, and a state that this library has given out.
    unsafe { set_state(instance, state) }
}

/// `fmi2FreeFMUstate`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeFMUstate(_instance: Fmi, state: *mut *mut Saved) -> Status {
    // SAFETY: a state that is null or that this library has given out.
    unsafe { free_state(state) }
}

/// `fmi2GetStatus`: no step goes on behind a call.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetStatus(_: Fmi, _kind: c_int, _: *mut Status) -> Status {
    Status::Discard
}

/// `fmi2GetRealStatus`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetRealStatus(instance: Fmi, kind: c_int, value: *mut f64) -> Status {
    if kind != LAST_SUCCESSFUL_TIME {
        return Status::Discard;
    }
    // SAFETY: an instance of the simulator, and a place for the result.
    unsafe {
        with(instance, |instance| {
            put(value, instance.time());
            Ok(())
        })
    }
}

/// `fmi2GetIntegerStatus`: there is none.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetIntegerStatus(_: Fmi, _kind: c_int, _: *mut c_int) -> Status {
    Status::Discard
}

/// `fmi2GetBooleanStatus`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetBooleanStatus(instance: Fmi, kind: c_int, value: *mut c_int) -> Status {
    if kind != TERMINATED {
        return Status::Discard;
    }
    // SAFETY: an instance of the simulator, and a place for the result.
    unsafe {
        with(instance, |instance| {
            put(value, c_int::from(instance.phase() == Phase::Terminated));
            Ok(())
        })
    }
}

/// `fmi2GetStringStatus`: there is none.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetStringStatus(_: Fmi, _kind: c_int, _: *mut *const c_char) -> Status {
    Status::Discard
}

/// Functions for what the unit does not have, whatever they are given.
macro_rules! absent {
    ($what:literal: $($name:ident($($argument:ty),*);)+) => {
        $(
            #[doc = concat!("`", stringify!($name), "`: the unit has no ", $what, ".")]
            // SAFETY: the name is the interface's.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $name(instance: Fmi $(, _: $argument)*) -> Status {
                // SAFETY: an instance of the simulator.
                unsafe { with(instance, |_| Err(concat!("this unit has no ", $what).to_owned())) }
            }
        )+
    };
}

absent! { "serialised states":
    fmi2SerializedFMUstateSize(*mut c_void, *mut usize);
    fmi2SerializeFMUstate(*mut c_void, *mut c_char, usize);
    fmi2DeSerializeFMUstate(*const c_char, usize, *mut *mut c_void);
}

absent! { "derivatives":
    fmi2GetDirectionalDerivative(Numbers, usize, Numbers, usize, *const f64, *mut f64);
    fmi2SetRealInputDerivatives(Numbers, usize, *const c_int, *const f64);
    fmi2GetRealOutputDerivatives(Numbers, usize, *const c_int, *mut f64);
}
