//! A simulator: it calls the library's functions through pointers, as C does.

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char, c_void};
use std::path::PathBuf;
use std::ptr::{null, null_mut};

use greyrig::exchange::Variable;
use greyrig::parameters::Settings;
use greyrig::parameters::block::{Header, MAX_PAYLOAD};
use greyrig::parameters::section;
use greyrig_fmi::fmi2::{self, Callbacks};
use greyrig_fmi::fmi3;
use greyrig_fmi::importer::{Component, Log2, Log3, Status};
use greyrig_fmi::instance::Saved;
use greyrig_fmi::resources::{BLOCK, TOKEN};
use tempfile::TempDir;

const GUID: &str = "{8c4e810f-3df3-4a00-8276-176fa3c9f000}";

thread_local! {
    static MESSAGES: RefCell<Vec<String>> = const { RefCell::new(Vec::new()) };
}

/// What this thread's units have told so far, which is then forgotten.
pub fn messages() -> Vec<String> {
    MESSAGES.take()
}

unsafe extern "C" fn log3(_: *mut c_void, _: Status, category: *const c_char, message: *const c_char) {
    // SAFETY: strings of the library.
    let [category, message] = unsafe { [CStr::from_ptr(category), CStr::from_ptr(message)] };
    assert_eq!(category, c"logStatusError");
    MESSAGES.with_borrow_mut(|all| all.push(message.to_str().expect("UTF-8").to_owned()));
}

/// The log of the older version takes a format and its values, which a function in Rust cannot; the library gives one.
unsafe extern "C" fn log2(
    _: *mut c_void,
    name: *const c_char,
    _: Status,
    _: *const c_char,
    format: *const c_char,
    message: *const c_char,
) {
    // SAFETY: strings of the library.
    let [name, format, message] = unsafe { [CStr::from_ptr(name), CStr::from_ptr(format), CStr::from_ptr(message)] };
    assert_eq!((name, format), (c"motor", c"%s"));
    MESSAGES.with_borrow_mut(|all| all.push(message.to_str().expect("UTF-8").to_owned()));
}

/// The resources of a unit, unpacked.
pub struct Folder(TempDir);

impl Folder {
    pub fn of(settings: &Settings) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut payload = [0; MAX_PAYLOAD];
        let payload = section::encode(settings, &mut payload).expect("room");
        let block = [&Header::seal(0, payload).to_bytes()[..], payload].concat();
        std::fs::write(folder.path().join(BLOCK), block).expect("it is written");
        std::fs::write(folder.path().join(TOKEN), GUID).expect("it is written");
        Self(folder)
    }

    pub fn block(&self) -> PathBuf {
        self.0.path().join(BLOCK)
    }

    fn path(&self) -> CString {
        CString::new(self.0.path().to_str().expect("UTF-8")).expect("no zero byte")
    }
}

/// An instance by FMI 3.0.
pub struct Three {
    component: *mut Component,
    time: f64,
}

impl Drop for Three {
    fn drop(&mut self) {
        // SAFETY: an instance that is not used any more.
        unsafe { fmi3::fmi3FreeInstance(self.component) }
    }
}

impl Three {
    pub fn with_token(folder: &Folder, token: &str) -> Option<Self> {
        let (token, path) = (CString::new(token).unwrap(), folder.path());
        let (name, log) = (c"motor".as_ptr(), Some(log3 as Log3));
        // SAFETY: strings that outlive the call.
        let component = unsafe {
            fmi3::fmi3InstantiateCoSimulation(
                name,
                token.as_ptr(),
                path.as_ptr(),
                false,
                false,
                false,
                false,
                null(),
                0,
                null_mut(),
                log,
                null(),
            )
        };
        (!component.is_null()).then_some(Self { component, time: 0.0 })
    }

    pub fn made(folder: &Folder) -> Option<Self> {
        Self::with_token(folder, GUID)
    }

    pub fn started(folder: &Folder, values: &[(Variable, f64)]) -> Self {
        let mut unit = Self::made(folder).expect("an instance");
        values.iter().for_each(|(variable, value)| unit.set(*variable, *value));
        unit.initialize(0.0);
        unit
    }

    pub fn initialize(&mut self, start: f64) {
        assert_eq!([self.enter(start), self.exit()], [Status::Ok; 2], "{:?}", messages());
        self.time = start;
    }

    pub fn enter(&mut self, start: f64) -> Status {
        // SAFETY: an instance.
        unsafe { fmi3::fmi3EnterInitializationMode(self.component, false, 0.0, start, false, 0.0) }
    }

    pub fn exit(&mut self) -> Status {
        // SAFETY: an instance.
        unsafe { fmi3::fmi3ExitInitializationMode(self.component) }
    }

    pub fn terminate(&mut self) -> Status {
        // SAFETY: an instance.
        unsafe { fmi3::fmi3Terminate(self.component) }
    }

    pub fn reset(&mut self) -> Status {
        // SAFETY: an instance.
        unsafe { fmi3::fmi3Reset(self.component) }
    }

    pub fn try_set(&mut self, numbers: &[u32], values: &[f64]) -> Status {
        // SAFETY: an instance, and arrays with their lengths.
        unsafe { fmi3::fmi3SetFloat64(self.component, numbers.as_ptr(), numbers.len(), values.as_ptr(), values.len()) }
    }

    pub fn set(&mut self, variable: Variable, value: f64) {
        assert_eq!(self.try_set(&[variable.number()], &[value]), Status::Ok, "{:?}", messages());
    }

    pub fn try_get(&self, number: u32) -> Status {
        let mut value = 0.0;
        // SAFETY: an instance, and places for one value.
        unsafe { fmi3::fmi3GetFloat64(self.component, &number, 1, &mut value, 1) }
    }

    fn get_each<const N: usize>(&self, variables: [Variable; N]) -> [f64; N] {
        let (numbers, mut values) = (variables.map(Variable::number), [f64::NAN; N]);
        // SAFETY: an instance, and arrays with their lengths.
        let status = unsafe { fmi3::fmi3GetFloat64(self.component, numbers.as_ptr(), N, values.as_mut_ptr(), N) };
        assert_eq!(status, Status::Ok, "{:?}", messages());
        values
    }

    pub fn get(&self, variable: Variable) -> f64 {
        self.get_each([variable])[0]
    }

    pub fn outputs(&self) -> [f64; 3] {
        self.get_each([Variable::Current, Variable::Speed, Variable::Torque])
    }

    pub fn try_step(&mut self, time: f64, step: f64) -> Status {
        let (mut flags, mut last) = ([true; 3], f64::NAN);
        let [events, end, early] = &mut flags;
        // SAFETY: an instance, and places for the results.
        let status = unsafe { fmi3::fmi3DoStep(self.component, time, step, true, events, end, early, &mut last) };
        assert_eq!((flags, last), ([false; 3], self.get(Variable::Time)));
        status
    }

    pub fn step(&mut self, step: f64) {
        assert_eq!(self.try_step(self.time, step), Status::Ok, "{:?}", messages());
        self.time += step;
    }

    pub fn state(&mut self) -> (*mut Saved, f64) {
        let mut state = null_mut();
        // SAFETY: an instance, and a place for the state.
        assert_eq!(unsafe { fmi3::fmi3GetFMUState(self.component, &mut state) }, Status::Ok);
        (state, self.time)
    }

    pub fn go_back_to(&mut self, (state, time): &(*mut Saved, f64)) {
        // SAFETY: an instance, and its state.
        assert_eq!(unsafe { fmi3::fmi3SetFMUState(self.component, *state) }, Status::Ok);
        self.time = *time;
    }

    pub fn free(&mut self, (mut state, _): (*mut Saved, f64)) {
        // SAFETY: a state that is not used any more.
        assert_eq!(unsafe { fmi3::fmi3FreeFMUState(self.component, &mut state) }, Status::Ok);
        assert!(state.is_null());
    }

    pub fn with_null_arrays(&mut self) -> Status {
        // SAFETY: null is met with an error.
        unsafe { fmi3::fmi3GetFloat64(self.component, null(), 1, null_mut(), 1) }
    }

    /// No variable, and one, of a type that there is none of.
    pub fn of_another_type(&mut self) -> [Status; 2] {
        let (number, mut value) = (1, 0);
        // SAFETY: an instance, and places for one value.
        [0, 1].map(|n| unsafe { fmi3::fmi3GetInt32(self.component, &number, n, &mut value, n) })
    }
}

/// What model exchange gives: nothing.
pub fn model_exchange(folder: &Folder) -> *mut Component {
    let (token, path) = (CString::new(GUID).unwrap(), folder.path());
    // SAFETY: strings that outlive the call.
    unsafe {
        let name = c"motor".as_ptr();
        fmi3::fmi3InstantiateModelExchange(name, token.as_ptr(), path.as_ptr(), false, false, null_mut(), Some(log3))
    }
}

/// An instance by FMI 2.0.
pub struct Two {
    component: *mut Component,
    time: f64,
    /// It outlives the instance.
    _callbacks: Box<Callbacks>,
}

impl Drop for Two {
    fn drop(&mut self) {
        // SAFETY: an instance that is not used any more.
        unsafe { fmi2::fmi2FreeInstance(self.component) }
    }
}

impl Two {
    pub fn with_token(folder: &Folder, token: &str) -> Option<Self> {
        let uri = format!("file://{}", folder.0.path().display());
        let [token, uri] = [token, &uri].map(|text| CString::new(text).unwrap());
        // SAFETY: on all systems that the tests run on, a call with a value behind the named arguments passes it as a
        // further named argument is passed.
        let logger: Log2 = unsafe { std::mem::transmute(log2 as *const c_void) };
        let (allocate_memory, free_memory, step_finished) = (null(), null(), null());
        let environment = null_mut();
        let callbacks =
            Box::new(Callbacks { logger: Some(logger), allocate_memory, free_memory, step_finished, environment });
        // SAFETY: strings and callbacks that outlive the call.
        let component = unsafe {
            fmi2::fmi2Instantiate(c"motor".as_ptr(), 1, token.as_ptr(), uri.as_ptr(), &raw const *callbacks, 0, 0)
        };
        (!component.is_null()).then_some(Self { component, time: 0.0, _callbacks: callbacks })
    }

    pub fn started(folder: &Folder, values: &[(Variable, f64)]) -> Self {
        let mut unit = Self::with_token(folder, GUID).expect("an instance");
        values.iter().for_each(|(variable, value)| unit.set(*variable, *value));
        // SAFETY: an instance.
        let statuses = unsafe {
            [
                fmi2::fmi2SetupExperiment(unit.component, 0, 0.0, 0.0, 0, 0.0),
                fmi2::fmi2EnterInitializationMode(unit.component),
                fmi2::fmi2ExitInitializationMode(unit.component),
            ]
        };
        assert_eq!(statuses, [Status::Ok; 3], "{:?}", messages());
        unit
    }

    pub fn set(&mut self, variable: Variable, value: f64) {
        let number = variable.number();
        // SAFETY: an instance, and one value.
        let status = unsafe { fmi2::fmi2SetReal(self.component, &number, 1, &value) };
        assert_eq!(status, Status::Ok, "{:?}", messages());
    }

    pub fn step(&mut self, step: f64) {
        // SAFETY: an instance.
        let status = unsafe { fmi2::fmi2DoStep(self.component, self.time, step, 1) };
        assert_eq!(status, Status::Ok, "{:?}", messages());
        self.time += step;
    }

    pub fn outputs(&self) -> [f64; 3] {
        let numbers = [Variable::Current, Variable::Speed, Variable::Torque].map(Variable::number);
        let mut values = [f64::NAN; 3];
        // SAFETY: an instance, and arrays with their lengths.
        let status = unsafe { fmi2::fmi2GetReal(self.component, numbers.as_ptr(), 3, values.as_mut_ptr()) };
        assert_eq!(status, Status::Ok, "{:?}", messages());
        values
    }
}
