//! The functions of FMI 3.0. Those of model exchange and scheduled execution make no instance, and what a unit for
//! co-simulation without events, clocks, and variables but real ones does not have is refused.
//!
//! Source: Functional Mock-up Interface Specification 3.0.2, with its header files.
//!
//! # Safety
//! All functions: as [`importer`](crate::importer) says.
#![allow(non_snake_case, clippy::missing_safety_doc, clippy::too_many_arguments)]

use std::ffi::{c_char, c_void};
use std::path::Path;

use crate::importer::{
    Component, Log, Log3, Status, free, free_state, get_state, put, read, set_state, text, with, write,
};
use crate::instance::{Instance, Saved};
use crate::resources;

type Fmi = *mut Component;
type Numbers = *const u32;

/// `fmi3GetVersion`.
// SAFETY: the name is the interface's; a simulator loads it from this library by its handle.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

/// `fmi3InstantiateCoSimulation`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
    name: *const c_char,
    token: *const c_char,
    resource_path: *const c_char,
    _visible: bool,
    _logging_on: bool,
    _event_mode_used: bool,
    _early_return_allowed: bool,
    _intermediate: Numbers,
    _intermediate_count: usize,
    environment: *mut c_void,
    log: Option<Log3>,
    _intermediate_update: *const c_void,
) -> Fmi {
    // SAFETY: strings of the simulator.
    let [name, token, folder] = unsafe { [text(name), text(token), text(resource_path)] };
    Component::give_out(&name, Log::Three(environment, log), || {
        resources::read(Path::new(&folder), &token).map(Instance::new)
    })
}

/// `fmi3FreeInstance`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeInstance(instance: Fmi) {
    // SAFETY: an instance of the simulator, which is not used any more.
    unsafe { free(instance) }
}

/// `fmi3EnterInitializationMode`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EnterInitializationMode(
    instance: Fmi,
    _tolerance_defined: bool,
    _tolerance: f64,
    start_time: f64,
    _stop_time_defined: bool,
    _stop_time: f64,
) -> Status {
    // SAFETY: an instance of the simulator.
    unsafe { with(instance, |instance| instance.enter_initialization(start_time)) }
}

/// `fmi3GetFloat64`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFloat64(
    instance: Fmi,
    numbers: Numbers,
    count: usize,
    values: *mut f64,
    value_count: usize,
) -> Status {
    // SAFETY: an instance and arrays of the simulator.
    unsafe { read(instance, [count, value_count], numbers, values) }
}

/// `fmi3SetFloat64`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFloat64(
    instance: Fmi,
    numbers: Numbers,
    count: usize,
    values: *const f64,
    value_count: usize,
) -> Status {
    // SAFETY: an instance and arrays of the simulator.
    unsafe { write(instance, [count, value_count], numbers, values) }
}

/// `fmi3DoStep`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DoStep(
    instance: Fmi,
    time: f64,
    step: f64,
    _no_set_state_before: bool,
    event_handling_needed: *mut bool,
    terminate_simulation: *mut bool,
    early_return: *mut bool,
    last_successful_time: *mut f64,
) -> Status {
    // SAFETY: an instance of the simulator, and places for the results.
    unsafe {
        for place in [event_handling_needed, terminate_simulation, early_return] {
            put(place, false);
        }
        with(instance, |instance| {
            let result = instance.step(time, step);
            put(last_successful_time, instance.time());
            result
        })
    }
}

/// `fmi3GetFMUState`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFMUState(instance: Fmi, state: *mut *mut Saved) -> Status {
    // SAFETY: an instance of the simulator, and a state that is null or that this library has given out.
    unsafe { get_state(instance, state) }
}

/// `fmi3SetFMUState`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFMUState(instance: Fmi, state: *mut Saved) -> Status {
    // SAFETY: an instance of the simulator, and a state that this library has given out.
    unsafe { set_state(instance, state) }
}

/// `fmi3FreeFMUState`.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeFMUState(_instance: Fmi, state: *mut *mut Saved) -> Status {
    // SAFETY: a state that is null or that this library has given out.
    unsafe { free_state(state) }
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
    fmi3ExitInitializationMode: Instance::exit_initialization;
    fmi3Terminate: Instance::terminate;
    fmi3Reset: |instance| {
        instance.reset();
        Ok(())
    };
    fmi3EnterConfigurationMode: |_| Err(lacks("structural parameters"));
    fmi3ExitConfigurationMode: |_| Err(lacks("structural parameters"));
    fmi3EnterEventMode: |_| Err(lacks("events"));
    fmi3EnterStepMode: |_| Err(lacks("events"));
    fmi3EvaluateDiscreteStates: |_| Err(lacks("events"));
    fmi3EnterContinuousTimeMode: |_| Err(lacks("model exchange"));
}

fn lacks(what: &str) -> String {
    format!("this unit has no {what}")
}

/// `fmi3SetDebugLogging`: errors are told in any case, and there is nothing else.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetDebugLogging(_: Fmi, _on: bool, _count: usize, _categories: *const *const c_char) -> Status {
    Status::Ok
}

/// Functions of a type of which the unit has no variable: nothing can be asked of them.
macro_rules! of_type {
    ($($get:ident, $set:ident: $type:ty;)+) => {
        $(
            #[doc = concat!("`", stringify!($get), "`.")]
            // SAFETY: the name is the interface's.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $get(fmi: Fmi, _: Numbers, count: usize, _: *mut $type, _: usize) -> Status {
                // SAFETY: an instance of the simulator.
                unsafe { with(fmi, |_| none_of(count)) }
            }
            #[doc = concat!("`", stringify!($set), "`.")]
            // SAFETY: the name is the interface's.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $set(fmi: Fmi, _: Numbers, count: usize, _: *const $type, _: usize) -> Status {
                // SAFETY: an instance of the simulator.
                unsafe { with(fmi, |_| none_of(count)) }
            }
        )+
    };
}

fn none_of(count: usize) -> Result<(), String> {
    if count == 0 { Ok(()) } else { Err("the unit has variables of the type Float64 alone".to_owned()) }
}

of_type! {
    fmi3GetFloat32, fmi3SetFloat32: f32;
    fmi3GetInt8, fmi3SetInt8: i8;
    fmi3GetUInt8, fmi3SetUInt8: u8;
    fmi3GetInt16, fmi3SetInt16: i16;
    fmi3GetUInt16, fmi3SetUInt16: u16;
    fmi3GetInt32, fmi3SetInt32: i32;
    fmi3GetUInt32, fmi3SetUInt32: u32;
    fmi3GetInt64, fmi3SetInt64: i64;
    fmi3GetUInt64, fmi3SetUInt64: u64;
    fmi3GetBoolean, fmi3SetBoolean: bool;
    fmi3GetString, fmi3SetString: *const c_char;
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
                unsafe { with(instance, |_| Err(lacks($what))) }
            }
        )+
    };
}

absent! { "binary variables":
    fmi3GetBinary(Numbers, usize, *mut usize, *mut *const u8, usize);
    fmi3SetBinary(Numbers, usize, *const usize, *const *const u8, usize);
}

absent! { "clocks":
    fmi3GetClock(Numbers, usize, *mut bool);
    fmi3SetClock(Numbers, usize, *const bool);
    fmi3GetIntervalDecimal(Numbers, usize, *mut f64, *mut i32);
    fmi3GetIntervalFraction(Numbers, usize, *mut u64, *mut u64, *mut i32);
    fmi3GetShiftDecimal(Numbers, usize, *mut f64);
    fmi3GetShiftFraction(Numbers, usize, *mut u64, *mut u64);
    fmi3SetIntervalDecimal(Numbers, usize, *const f64);
    fmi3SetIntervalFraction(Numbers, usize, *const u64, *const u64);
    fmi3SetShiftDecimal(Numbers, usize, *const f64);
    fmi3SetShiftFraction(Numbers, usize, *const u64, *const u64);
    fmi3ActivateModelPartition(u32, f64);
}

absent! { "dependencies of single elements":
    fmi3GetNumberOfVariableDependencies(u32, *mut usize);
    fmi3GetVariableDependencies(u32, *mut usize, *mut u32, *mut usize, *mut i32, usize);
}

absent! { "serialised states":
    fmi3SerializedFMUStateSize(*mut c_void, *mut usize);
    fmi3SerializeFMUState(*mut c_void, *mut u8, usize);
    fmi3DeserializeFMUState(*const u8, usize, *mut *mut c_void);
}

absent! { "derivatives":
    fmi3GetDirectionalDerivative(Numbers, usize, Numbers, usize, *const f64, usize, *mut f64, usize);
    fmi3GetAdjointDerivative(Numbers, usize, Numbers, usize, *const f64, usize, *mut f64, usize);
    fmi3GetOutputDerivatives(Numbers, usize, *const i32, *mut f64, usize);
}

absent! { "events":
    fmi3UpdateDiscreteStates(*mut bool, *mut bool, *mut bool, *mut bool, *mut bool, *mut f64);
}

absent! { "model exchange":
    fmi3CompletedIntegratorStep(bool, *mut bool, *mut bool);
    fmi3SetTime(f64);
    fmi3SetContinuousStates(*const f64, usize);
    fmi3GetContinuousStateDerivatives(*mut f64, usize);
    fmi3GetEventIndicators(*mut f64, usize);
    fmi3GetContinuousStates(*mut f64, usize);
    fmi3GetNominalsOfContinuousStates(*mut f64, usize);
    fmi3GetNumberOfEventIndicators(*mut usize);
    fmi3GetNumberOfContinuousStates(*mut usize);
}

/// `fmi3InstantiateModelExchange`: the unit is for co-simulation alone.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateModelExchange(
    name: *const c_char,
    _token: *const c_char,
    _resource_path: *const c_char,
    _visible: bool,
    _logging_on: bool,
    environment: *mut c_void,
    log: Option<Log3>,
) -> Fmi {
    // SAFETY: a string of the simulator.
    let name = unsafe { text(name) };
    Component::give_out(&name, Log::Three(environment, log), || Err(lacks("model exchange")))
}

/// `fmi3InstantiateScheduledExecution`: the unit is for co-simulation alone.
// SAFETY: the name is the interface's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateScheduledExecution(
    name: *const c_char,
    _token: *const c_char,
    _resource_path: *const c_char,
    _visible: bool,
    _logging_on: bool,
    environment: *mut c_void,
    log: Option<Log3>,
    _clock_update: *const c_void,
    _lock_preemption: *const c_void,
    _unlock_preemption: *const c_void,
) -> Fmi {
    // SAFETY: a string of the simulator.
    let name = unsafe { text(name) };
    Component::give_out(&name, Log::Three(environment, log), || Err(lacks("scheduled execution")))
}
