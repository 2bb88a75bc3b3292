//! The simulator's side: its memory, its log, and the box in which it holds an instance.
//!
//! # Safety
//! Nothing but the standard of the interface says what a pointer from a simulator leads to. What it says is the reason
//! of all blocks of `unsafe` in this crate:
//!
//! - an instance is one that this library has given out and that has not been freed, and it is used by one thread at a
//!   time;
//! - an array has as many values as its length says, and may be null where that is 0;
//! - a string ends with a zero byte;
//! - where a result goes, there is room for it.
//!
//! Null is met with an error wherever a pointer must not be null.

use std::ffi::{CStr, CString, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::instance::{Instance, Refusal, Saved};

/// What a function answers, in both versions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum Status {
    /// Done.
    Ok = 0,
    /// Done, but something is odd.
    Warning = 1,
    /// Not done; the state is as before.
    Discard = 2,
    /// Not done; the instance can be reset.
    Error = 3,
    /// Not done; no instance can be used any longer.
    Fatal = 4,
}

/// The log of a simulator.
#[derive(Clone, Copy)]
pub enum Log {
    /// FMI 3.0.
    Three(*mut c_void, Option<Log3>),
    /// FMI 2.0.
    Two(*mut c_void, Option<Log2>),
}

/// Of FMI 3.0: environment, status, category, message.
pub type Log3 = unsafe extern "C" fn(*mut c_void, Status, *const c_char, *const c_char);
/// Of FMI 2.0: environment, name of the instance, status, category, format, values of the format.
pub type Log2 = unsafe extern "C" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char, ...);

/// The category of all messages.
pub const CATEGORY: &CStr = c"logStatusError";

impl Log {
    /// Tells the user of the simulator why a call is refused.
    pub fn tell(self, instance: &CStr, status: Status, message: &str) {
        // A zero byte would end it.
        let message = CString::new(message.replace('\0', " ")).unwrap_or_default();
        match self {
            // SAFETY: the simulator's own function, called as the standard has it, with strings that outlive the call.
            Self::Three(environment, Some(log)) => unsafe {
                log(environment, status, CATEGORY.as_ptr(), message.as_ptr());
            },
            // SAFETY: likewise; the format takes one string, so that nothing in the message is taken for a format.
            Self::Two(environment, Some(log)) => unsafe {
                log(environment, instance.as_ptr(), status, CATEGORY.as_ptr(), c"%s".as_ptr(), message.as_ptr());
            },
            Self::Three(_, None) | Self::Two(_, None) => {}
        }
    }
}

/// What a simulator holds.
pub struct Component {
    /// The instance.
    pub instance: Instance,
    name: CString,
    log: Log,
}

impl Component {
    /// Makes an instance; null, with a message in the log, where that does not go.
    pub fn give_out(name: &str, log: Log, made: impl FnOnce() -> Result<Instance, Refusal>) -> *mut Self {
        let name = CString::new(name.replace('\0', " ")).unwrap_or_default();
        let made = catch_unwind(AssertUnwindSafe(made)).unwrap_or_else(|_| Err(FAULT.to_owned()));
        match made {
            Ok(instance) => Box::into_raw(Box::new(Self { instance, name, log })),
            Err(message) => {
                log.tell(&name, Status::Error, &message);
                std::ptr::null_mut()
            }
        }
    }
}

const FAULT: &str = "the library has a fault; report this as a bug";

/// Does something with an instance, and tells why it does not go.
///
/// # Safety
/// The pointer is null or an instance that [`Component::give_out`] has given out; see the module.
pub unsafe fn with(component: *mut Component, work: impl FnOnce(&mut Instance) -> Result<(), Refusal>) -> Status {
    // SAFETY: the caller's.
    let Some(component) = (unsafe { component.as_mut() }) else { return Status::Error };
    let instance = &mut component.instance;
    // No fault of ours may unwind into what C has made.
    let (status, message) = match catch_unwind(AssertUnwindSafe(|| work(instance))) {
        Ok(Ok(())) => return Status::Ok,
        Ok(Err(message)) => (Status::Error, message),
        Err(_) => (Status::Fatal, FAULT.to_owned()),
    };
    component.log.tell(&component.name, status, &message);
    status
}

/// Frees an instance.
///
/// # Safety
/// As [`with`]; it is not used any more.
pub unsafe fn free(component: *mut Component) {
    if !component.is_null() {
        // SAFETY: the caller's; it comes from `Box::into_raw`.
        drop(unsafe { Box::from_raw(component) });
    }
}

/// The values of an array.
///
/// # Errors
/// Null where there ought to be values.
///
/// # Safety
/// See the module.
pub unsafe fn values<'a, T>(array: *const T, length: usize) -> Result<&'a [T], Refusal> {
    match (length, array.is_null()) {
        (0, _) => Ok(&[]),
        (_, true) => Err("a null pointer stands where an array ought to be".to_owned()),
        // SAFETY: the caller's.
        (_, false) => Ok(unsafe { std::slice::from_raw_parts(array, length) }),
    }
}

/// The same of an array that is filled.
///
/// # Errors
/// As [`values`].
///
/// # Safety
/// See the module.
pub unsafe fn places<'a, T>(array: *mut T, length: usize) -> Result<&'a mut [T], Refusal> {
    match (length, array.is_null()) {
        (0, _) => Ok(&mut []),
        (_, true) => Err("a null pointer stands where an array ought to be".to_owned()),
        // SAFETY: the caller's.
        (_, false) => Ok(unsafe { std::slice::from_raw_parts_mut(array, length) }),
    }
}

/// A string; empty for null.
///
/// # Safety
/// See the module.
pub unsafe fn text(string: *const c_char) -> String {
    if string.is_null() {
        return String::new();
    }
    // SAFETY: the caller's.
    unsafe { CStr::from_ptr(string) }.to_string_lossy().into_owned()
}

/// Puts a result where it belongs, if it is wanted.
///
/// # Safety
/// See the module.
pub unsafe fn put<T>(place: *mut T, value: T) {
    if !place.is_null() {
        // SAFETY: the caller's.
        unsafe { place.write(value) };
    }
}

/// Reads variables of an instance.
///
/// # Safety
/// As [`with`], and [`values`].
pub unsafe fn read(
    component: *mut Component,
    [numbers, results]: [usize; 2],
    at: *const u32,
    into: *mut f64,
) -> Status {
    // SAFETY: the caller's.
    unsafe {
        with(component, |instance| {
            same(numbers, results)?;
            for (number, place) in values(at, numbers)?.iter().zip(places(into, results)?) {
                *place = instance.get(*number)?;
            }
            Ok(())
        })
    }
}

/// Sets variables of an instance: all of them, or none.
///
/// # Safety
/// As [`with`], and [`values`].
pub unsafe fn write(
    component: *mut Component,
    [numbers, given]: [usize; 2],
    at: *const u32,
    from: *const f64,
) -> Status {
    // SAFETY: the caller's.
    unsafe {
        with(component, |instance| {
            same(numbers, given)?;
            let before = instance.saved();
            for (number, value) in values(at, numbers)?.iter().zip(values(from, given)?) {
                instance.set(*number, *value).inspect_err(|_| instance.restore(&before))?;
            }
            Ok(())
        })
    }
}

/// Saves the state of an instance, into a place that holds null or an earlier one.
///
/// # Safety
/// An instance of the simulator, and a state that is null or that this library has given out.
pub unsafe fn get_state(component: *mut Component, state: *mut *mut Saved) -> Status {
    // SAFETY: the caller's.
    unsafe {
        with(component, |instance| {
            let place = state.as_mut().ok_or("there is no place for the state")?;
            match place.as_mut() {
                Some(earlier) => *earlier = instance.saved(),
                None => *place = Box::into_raw(Box::new(instance.saved())),
            }
            Ok(())
        })
    }
}

/// Goes back to a state.
///
/// # Safety
/// As [`get_state`].
pub unsafe fn set_state(component: *mut Component, state: *const Saved) -> Status {
    // SAFETY: the caller's.
    unsafe {
        with(component, |instance| {
            instance.restore(state.as_ref().ok_or("there is no state to go back to")?);
            Ok(())
        })
    }
}

/// Frees a state.
///
/// # Safety
/// As [`get_state`].
pub unsafe fn free_state(state: *mut *mut Saved) -> Status {
    // SAFETY: the caller's; what is not null comes from `Box::into_raw`.
    unsafe {
        if let Some(place) = state.as_mut()
            && !place.is_null()
        {
            drop(Box::from_raw(*place));
            *place = std::ptr::null_mut();
        }
    }
    Status::Ok
}

fn same(numbers: usize, values: usize) -> Result<(), Refusal> {
    if numbers == values { Ok(()) } else { Err(format!("{numbers} value references and {values} values do not match")) }
}
