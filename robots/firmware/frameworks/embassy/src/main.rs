//! The Panda's controller as a task of embassy, once a millisecond, on an STM32G474; what is wanted comes from another task.
#![no_std]
#![no_main]
#![forbid(unsafe_code)]

#[path = "../../drives.rs"]
mod drives;

use drives::Drives;
use embassy_executor::Spawner;
use embassy_sync::blocking_mutex::raw::ThreadModeRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Ticker, Timer};
use panic_halt as _;
use straightline_firmware_example::arm::{control_step, Gains, Panda, Wanted};

/// What is wanted next.
static WANTED: Signal<ThreadModeRawMutex, Wanted> = Signal::new();
const GAINS: Gains = Gains { stiffness: [400.0; Panda::NV], damping: [40.0; Panda::NV] };

#[embassy_executor::task]
async fn control() {
    let mut drives = Drives;
    let mut tick = Ticker::every(Duration::from_millis(1));
    let mut wanted = WANTED.wait().await;
    let mut tau = [0.0; Panda::NV];
    loop {
        wanted = WANTED.try_take().unwrap_or(wanted);
        // a fault leaves all torques zero
        let _ = control_step(&GAINS, &wanted, &drives.measured(), &mut tau);
        drives.set(&tau);
        tick.next().await;
    }
}

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let _peripherals = embassy_stm32::init(embassy_stm32::Config::default());
    spawner.spawn(control().expect("it runs once"));
    let mut to_the_left = true;
    loop {
        let q = [if to_the_left { 0.3 } else { -0.3 }, -0.8, 0.0, -2.2, 0.0, 1.6, 0.8];
        WANTED.signal(Wanted { q, qd: [0.0; Panda::NV], qdd: [0.0; Panda::NV] });
        to_the_left = !to_the_left;
        Timer::after(Duration::from_secs(2)).await;
    }
}
