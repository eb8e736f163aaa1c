//! The Panda's controller as a task of RTIC, once a millisecond, on an STM32G474; what is wanted comes from a task of lower priority.
#![no_std]
#![no_main]

use panic_halt as _;

#[path = "../../drives.rs"]
mod drives;

#[rtic::app(device = stm32g4::stm32g474, dispatchers = [EXTI0, EXTI1])]
mod app {
    use super::drives::Drives;
    use rtic_monotonics::systick::prelude::*;
    use straightline_firmware_example::arm::{control_step, Gains, Panda, Wanted};

    systick_monotonic!(Mono, 1000);

    /// After reset the processor runs at 16 MHz.
    const CLOCK: u32 = 16_000_000;
    const GAINS: Gains = Gains { stiffness: [400.0; Panda::NV], damping: [40.0; Panda::NV] };

    #[shared]
    struct Shared {
        wanted: Wanted,
    }

    #[local]
    struct Local {
        drives: Drives,
    }

    #[init]
    fn init(cx: init::Context) -> (Shared, Local) {
        Mono::start(cx.core.SYST, CLOCK);
        control::spawn().expect("it runs once");
        plan::spawn().expect("it runs once");
        (Shared { wanted: towards(0.0) }, Local { drives: Drives })
    }

    fn towards(first: f32) -> Wanted {
        let q = [first, -0.8, 0.0, -2.2, 0.0, 1.6, 0.8];
        Wanted { q, qd: [0.0; Panda::NV], qdd: [0.0; Panda::NV] }
    }

    #[task(priority = 2, shared = [wanted], local = [drives])]
    async fn control(mut cx: control::Context) {
        let mut next = Mono::now();
        let mut tau = [0.0; Panda::NV];
        loop {
            let measured = cx.local.drives.measured();
            let wanted = cx.shared.wanted.lock(|wanted| wanted.clone());
            // a fault leaves all torques zero
            let _ = control_step(&GAINS, &wanted, &measured, &mut tau);
            cx.local.drives.set(&tau);
            next += 1.millis();
            Mono::delay_until(next).await;
        }
    }

    #[task(priority = 1, shared = [wanted])]
    async fn plan(mut cx: plan::Context) {
        loop {
            for first in [0.3, -0.3] {
                cx.shared.wanted.lock(|wanted| *wanted = towards(first));
                Mono::delay(2.secs()).await;
            }
        }
    }
}
