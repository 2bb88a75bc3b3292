//! An instance of a unit: the model, its variables, and how it is stepped.
//!
//! # Steps
//! Within a communication step the voltage and the load are held. The model goes through it in steps of its own
//! interval; where that does not divide the communication step, in the fewest equal steps that are not longer. With
//! communication steps of its interval, or a multiple, it so computes the very numbers of the microcontroller on a held
//! voltage.
//!
//! # Outputs
//! Current and speed are what the measuring chain shows. A learned correction is that of the voltage that is set when
//! the current is asked for.

use std::collections::BTreeMap;

use greyrig::anfis::{Anfis3x3, Settings3x3};
use greyrig::exchange::Variable;
use greyrig::hybrid::corrected;
use greyrig::motor::{Constraints, MAX_TERMS, Motor, OperatingPoint, State, Stepper};
use greyrig::parameters::Settings;
use greyrig::term::{MAX_UNKNOWNS, Op, Target, Term};

/// Share of the model's interval by which a communication step may miss a multiple of it: times in a simulator are sums
/// that have been rounded.
const ROUNDED: f64 = 1e-6;

/// Why a call is refused, in a line.
pub type Refusal = String;

/// Where an instance is in its life.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Made, or reset: everything but outputs can be set.
    Instantiated,
    /// Between entering and exiting the initialization: likewise.
    Initialization,
    /// It is stepped: inputs can be set.
    Step,
    /// It has ended.
    Terminated,
}

/// All that changes in an instance.
#[derive(Debug, Clone)]
struct Course {
    phase: Phase,
    /// Time, s.
    time: f64,
    /// Values of parameters that were set, by their numbers.
    set: BTreeMap<u32, f64>,
    start: State<f64>,
    voltage: f64,
    load: f64,
    run: Option<Run>,
}

/// A model that runs.
#[derive(Debug, Clone)]
struct Run {
    motor: Motor<f32>,
    correction: Option<Anfis3x3>,
    stepper: Stepper<f32>,
    /// Interval, s, and load that the stepper is for.
    is_for: (f32, f32),
}

impl Run {
    fn build(settings: &Settings, interval: f32, load: f32, start: State<f32>) -> Result<Self, Refusal> {
        for effect in &settings.effects {
            effect.validate().map_err(|error| format!("the effect {}: {error}", effect.id()))?;
        }
        let motor = Motor::build(settings.motor, &settings.effects).and_then(|m| m.with_terms(&settings.terms));
        let motor = motor.map_err(|error| error.to_string())?;
        let correction = settings.correction.as_ref().map(Settings3x3::build).transpose();
        let correction = correction.map_err(|error| format!("the correction: {error}"))?;
        let mut stepper = loaded(&motor, interval, load)?;
        stepper.set_state(start);
        Ok(Self { motor, correction, stepper, is_for: (interval, load) })
    }

    /// Makes the stepper that of an interval and a load.
    fn prepare(&mut self, interval: f32, load: f32) -> Result<(), Refusal> {
        if self.is_for != (interval, load) {
            let mut stepper = loaded(&self.motor, interval, load)?;
            stepper.restore(&self.stepper.snapshot());
            (self.stepper, self.is_for) = (stepper, (interval, load));
        }
        Ok(())
    }

    /// What the measuring chain shows, with the correction at a voltage, V.
    fn reading(&self, voltage: f32) -> State<f32> {
        let reading = self.stepper.reading();
        match &self.correction {
            Some(correction) => corrected(correction, voltage, reading, Constraints::FREE).0,
            None => reading,
        }
    }

    /// K φ i, N m or N, at a voltage, V.
    fn torque(&self, voltage: f32) -> f32 {
        let State { current, speed } = self.stepper.state();
        let memories = self.stepper.snapshot().memories;
        let balance = self.motor.balance(&OperatingPoint { current, speed, voltage }, &memories);
        self.motor.linkage(&balance) * current
    }
}

/// A motor that is braked by a load, N m or N, to be stepped by an interval, s.
fn loaded(motor: &Motor<f32>, interval: f32, load: f32) -> Result<Stepper<f32>, Refusal> {
    let mut motor = motor.clone();
    if load != 0.0 {
        let mut unknowns = [0.0; MAX_UNKNOWNS];
        unknowns[0] = f64::from(load);
        let load = Term::build(Target::Torque, &[Op::Unknown(0)], unknowns).map_err(|error| error.to_string())?;
        let terms: Vec<Term<f32>> = motor.terms().iter().copied().chain([load]).collect();
        motor = motor.with_terms(&terms).map_err(|error| error.to_string())?;
    }
    Stepper::build(motor, interval).map_err(|error| error.to_string())
}

/// The shortest decimal number that is this one in single precision: what was written as 2.2 is 2.2 again.
fn decimal(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

/// A motor in a simulator.
#[derive(Debug, Clone)]
pub struct Instance {
    settings: Settings,
    interval: f64,
    course: Course,
}

/// All that changes in an instance, to go back to.
#[derive(Debug, Clone)]
pub struct Saved(Course);

impl Instance {
    /// An instance of the model with these settings, whose interval is that of their filter.
    pub fn new(settings: Settings) -> Self {
        let interval = 1.0 / settings.filter.sample_rate_hz;
        Self { settings, interval, course: Course::NEW }
    }

    /// The model's interval, s.
    pub fn interval(&self) -> f64 {
        self.interval
    }

    /// Time, s.
    pub fn time(&self) -> f64 {
        self.course.time
    }

    /// Where it is in its life.
    pub fn phase(&self) -> Phase {
        self.course.phase
    }

    /// Whether it can be braked from outside: where terms of the user's own leave room for the load.
    pub fn takes_load(&self) -> bool {
        self.settings.terms.len() < MAX_TERMS
    }

    fn variable(&self, number: u32) -> Result<Variable, Refusal> {
        let variable = Variable::with_number(number).filter(|variable| match variable {
            Variable::Load => self.takes_load(),
            Variable::Base(_) | Variable::Effect { .. } | Variable::Term { .. } => {
                variable.value(&self.settings).is_some()
            }
            _ => true,
        });
        variable.ok_or_else(|| format!("there is no variable with the value reference {number}"))
    }

    /// The value of a variable.
    ///
    /// # Errors
    /// A number that belongs to none, or an output before there is one.
    pub fn get(&self, number: u32) -> Result<f64, Refusal> {
        let variable = self.variable(number)?;
        let course = &self.course;
        let output = |of: &dyn Fn(&Run) -> f32| match &course.run {
            Some(run) => Ok(f64::from(of(run))),
            None => self.started().map(|run| f64::from(of(&run))),
        };
        let voltage = course.voltage as f32;
        match variable {
            Variable::Time => Ok(course.time),
            Variable::Voltage => Ok(course.voltage),
            Variable::Load => Ok(course.load),
            Variable::Current => output(&|run| run.reading(voltage).current),
            Variable::Speed => output(&|run| run.reading(voltage).speed),
            Variable::Torque => output(&|run| run.torque(voltage)),
            Variable::StartCurrent => Ok(course.start.current),
            Variable::StartSpeed => Ok(course.start.speed),
            parameter => match course.set.get(&number) {
                Some(value) => Ok(*value),
                None => Ok(parameter.value(&self.settings).map_or(f64::NAN, decimal)),
            },
        }
    }

    /// Sets a variable.
    ///
    /// # Errors
    /// A number that belongs to none, a variable that cannot be set now, or a value that is no number.
    pub fn set(&mut self, number: u32, value: f64) -> Result<(), Refusal> {
        let variable = self.variable(number)?;
        if !(value as f32).is_finite() {
            return Err(format!(
                "the value reference {number} is set to {value}, which is no number that the model takes"
            ));
        }
        let course = &mut self.course;
        match variable {
            Variable::Voltage => course.voltage = value,
            Variable::Load => course.load = value,
            Variable::Time | Variable::Current | Variable::Speed | Variable::Torque => {
                return Err(format!("the value reference {number} is no input and no parameter, and cannot be set"));
            }
            _ if !matches!(course.phase, Phase::Instantiated | Phase::Initialization) => {
                return Err(format!("the value reference {number} can be set before and in the initialization only"));
            }
            Variable::StartCurrent => course.start.current = value,
            Variable::StartSpeed => course.start.speed = value,
            Variable::Base(_) | Variable::Effect { .. } | Variable::Term { .. } => _ = course.set.insert(number, value),
        }
        Ok(())
    }

    /// The model at its begin, with what has been set.
    fn started(&self) -> Result<Run, Refusal> {
        let mut settings = self.settings.clone();
        for (number, value) in &self.course.set {
            Variable::with_number(*number).and_then(|variable| variable.set(&mut settings, *value as f32));
        }
        let State { current, speed } = self.course.start;
        let start = State { current: current as f32, speed: speed as f32 };
        Run::build(&settings, self.interval as f32, self.course.load as f32, start)
    }

    fn refuse_unless(&self, phase: Phase, doing: &str) -> Result<(), Refusal> {
        if self.course.phase == phase {
            return Ok(());
        }
        Err(format!("{doing} does not go while the unit is {:?}; it has to be {phase:?}", self.course.phase))
    }

    /// The simulation will start at a time, s.
    ///
    /// # Errors
    /// Not after it was made or reset; a time that is no number.
    pub fn start_at(&mut self, start_time: f64) -> Result<(), Refusal> {
        self.refuse_unless(Phase::Instantiated, "setting the start")?;
        if !start_time.is_finite() {
            return Err(format!("the simulation cannot start at {start_time} s"));
        }
        self.course.time = start_time;
        Ok(())
    }

    /// Begins the initialization; the simulation starts at a time, s.
    ///
    /// # Errors
    /// As [`Instance::start_at`].
    pub fn enter_initialization(&mut self, start_time: f64) -> Result<(), Refusal> {
        self.start_at(start_time)?;
        self.course.phase = Phase::Initialization;
        Ok(())
    }

    /// Ends the initialization: the model begins to run with what has been set.
    ///
    /// # Errors
    /// Not in the initialization; a parameter that no motor can have.
    pub fn exit_initialization(&mut self) -> Result<(), Refusal> {
        self.refuse_unless(Phase::Initialization, "exiting the initialization")?;
        self.course.run = Some(self.started()?);
        self.course.phase = Phase::Step;
        Ok(())
    }

    /// Goes on by a communication step, s, from a time, s.
    ///
    /// # Errors
    /// Not after the initialization; a time that is not the present one; a step that is not positive; a model that
    /// diverges.
    pub fn step(&mut self, time: f64, step: f64) -> Result<(), Refusal> {
        self.refuse_unless(Phase::Step, "a step")?;
        let interval = self.interval;
        if !(step > 0.0 && step.is_finite()) {
            return Err(format!(
                "a communication step of {step} s cannot be: it has to be positive, best a multiple of the model's \
                 interval, {interval} s"
            ));
        }
        let course = &mut self.course;
        let rounded = ROUNDED * interval + 4.0 * f64::EPSILON * (course.time.abs() + step);
        let goes_on = (time - course.time).abs() <= rounded.max(0.5 * interval.min(step));
        if !goes_on {
            return Err(format!("a step from {time} s does not go on from the present time, {} s", course.time));
        }
        let multiple = (step / interval).round();
        let (steps, length) = if multiple >= 1.0 && (step - multiple * interval).abs() <= rounded {
            (multiple, interval)
        } else {
            let steps = (step / interval).ceil();
            (steps, step / steps)
        };
        let run = course.run.as_mut().ok_or("the model does not run")?;
        run.prepare(length as f32, course.load as f32)?;
        let voltage = course.voltage as f32;
        for _ in 0..steps as u64 {
            run.stepper.step(voltage, voltage, Constraints::FREE);
        }
        course.time = time + step;
        let State { current, speed } = run.stepper.state();
        if !(current.is_finite() && speed.is_finite()) {
            return Err(format!("the model diverges before {} s: its current or its speed is no number", course.time));
        }
        Ok(())
    }

    /// Ends the simulation.
    ///
    /// # Errors
    /// Not after the initialization.
    pub fn terminate(&mut self) -> Result<(), Refusal> {
        self.refuse_unless(Phase::Step, "ending the simulation")?;
        self.course.phase = Phase::Terminated;
        Ok(())
    }

    /// Makes it what it was when it was made.
    pub fn reset(&mut self) {
        self.course = Course::NEW;
    }

    /// All that changes in it.
    pub fn saved(&self) -> Saved {
        Saved(self.course.clone())
    }

    /// Goes back to where it was.
    pub fn restore(&mut self, saved: &Saved) {
        self.course = saved.0.clone();
    }
}

impl Course {
    const NEW: Self = Self {
        phase: Phase::Instantiated,
        time: 0.0,
        set: BTreeMap::new(),
        start: State { current: 0.0, speed: 0.0 },
        voltage: 0.0,
        load: 0.0,
        run: None,
    };
}
