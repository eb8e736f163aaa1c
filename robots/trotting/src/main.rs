//! x
use straightline_trotting_example::closed_loop::{run, Feedback, Scenario, EXAMPLE};
fn main() {
    for feedback in [Feedback::Gains, Feedback::Joints(3.0, 0.1), Feedback::Joints(6.0, 0.2), Feedback::Joints(20.0,0.4)] {
        let began = std::time::Instant::now();
        let (mut n, mut t) = (0, 0.0);
        run(&Scenario { feedback, ..EXAMPLE }, |c, x| { let b = std::time::Instant::now(); let s = c.sweep(x); t += b.elapsed().as_secs_f64(); n += 1; if n % 5 == 0 && feedback == Feedback::Gains { println!("{n} {s:.3?}") }; s }, |s| {
            if ((s.time * 1000.0).round() as i64) % 100 == 0 {
                let f: f64 = s.forces.iter().map(|f| f[2]).sum();
                println!("{:.2} {:?} off {:+.4} {:+.4} {:+.4} lean {:.3} yaw {:+.3} F {:.1} tau {:.2} slip {:.4?} w {:.2?}", s.time, s.mode, s.state.q[0]-s.wanted[0], s.state.q[1]-s.wanted[1], s.state.q[2]-s.wanted[2], s.lean, 2.0*s.state.q[5], f, s.torques.iter().fold(0.0f64, |m, t| m.max(t.abs())), s.slipped, s.wrench);
            }
        }).map_err(|e| e.to_string()).unwrap();
        println!("{feedback:?} sweeps {n} mean {:.0} us, took {:?}\n", t / n as f64 * 1e6, began.elapsed());
    }
}
