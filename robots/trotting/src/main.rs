//! x
use straightline_trotting_example::closed_loop::{run, Feedback, Scenario, EXAMPLE, Push};
use straightline_trotting_example::task::{Weights, within_cone};
use straightline_trotting_example::gait::Gait;
fn main() {
    let big = |f: f64| [Push { from: 0.2, until: 0.3, force: [0.0, f, 0.0] }, Push { from: 2.3, until: 2.4, force: [0.0, f, 0.0] }];
    let (b1, b2, b3) = (big(15.0), big(20.0), big(30.0));
    let w = |cone: f64| Weights { cone, ..Weights::DEFAULT };
    let cases: Vec<(&str, Scenario)> = vec![
        ("example", EXAMPLE),
        ("15 N", Scenario { pushes: &b1, ..EXAMPLE }),
        ("15 N cone 0", Scenario { pushes: &b1, weights: w(0.0), ..EXAMPLE }),
        ("15 N cone 20", Scenario { pushes: &b1, weights: w(20.0), ..EXAMPLE }),
        ("20 N", Scenario { pushes: &b2, ..EXAMPLE }),
        ("20 N joints", Scenario { pushes: &b2, feedback: Feedback::Joints(6.0, 0.2), ..EXAMPLE }),
        ("30 N", Scenario { pushes: &b3, ..EXAMPLE }),
        ("30 N joints", Scenario { pushes: &b3, feedback: Feedback::Joints(6.0, 0.2), ..EXAMPLE }),
        ("joints 3", Scenario { feedback: Feedback::Joints(3.0, 0.1), ..EXAMPLE }),
        ("joints 6", Scenario { feedback: Feedback::Joints(6.0, 0.2), ..EXAMPLE }),
        ("joints 12", Scenario { feedback: Feedback::Joints(12.0, 0.3), ..EXAMPLE }),
        ("cone 0", Scenario { weights: w(0.0), ..EXAMPLE }),
        ("fast 0.5", Scenario { gait: Gait { speed: [0.5, 0.0], ..EXAMPLE.gait }, ..EXAMPLE }),
        ("side 0.2", Scenario { gait: Gait { speed: [0.0, 0.2], ..EXAMPLE.gait }, ..EXAMPLE }),
        ("no load no push", Scenario { pushes: &[], load: 0.0, ..EXAMPLE }),
    ];
    let only = std::env::args().nth(1);
    for (name, case) in &cases {
        if only.as_ref().is_some_and(|o| o != name) { continue }
        let mut sq = [0.0f64; 4]; let mut worst = [0.0f64; 4]; let mut n = 0.0; let mut tau = 0.0f64; let mut sat = 0; let mut margin = f64::INFINITY; let mut last = None; let mut outside = 0;
        let (mut slip_loaded, mut prev) = ([0.0f64; 4], [0.0; 4]);
        run(case, |c, x| c.sweep(x), |s| {
            let e = [s.state.q[0]-s.wanted[0], s.state.q[1]-s.wanted[1], s.state.q[2]-s.wanted[2], s.lean];
            for i in 0..4 { sq[i] += e[i]*e[i]; worst[i] = worst[i].max(e[i].abs()); }
            n += 1.0; tau = s.torques.iter().fold(tau, |m, t| m.max(t.abs())); sat += (s.outcome == straightline::control::Outcome::Saturated) as i32;
            for f in 0..4 { if s.mode.stands(f) { if s.forces[f][2] > 0.5 { let m = within_cone(&s.forces[f], 0.6); margin = margin.min(m); outside += (m < 1e-9) as i32; slip_loaded[f] += s.slipped[f] - prev[f]; } } }
            if only.is_some() { for f in 0..4 { if s.slipped[f] > prev[f] + 2e-5 { println!("{:.3} foot {f} {:?} slips {:.5} {:?}", s.time, s.mode, s.slipped[f]-prev[f], s.forces[f]); } } }
            prev = s.slipped;
            last = Some(*s);
        }).map_err(|e| e.to_string()).unwrap();
        let l = last.unwrap();
        println!("{name}: end {:.2} rms mm {:.1?} lean {:.4} worst {:.1?} lean {:.3} end {:.1} {:.1} {:.1} tau {tau:.2} sat {sat} outside {outside} margin {margin:.2} slip {:.2?} loaded {:.2?} mm", l.time,
            [0,1,2].map(|i| 1e3*(sq[i]/n).sqrt()), (sq[3]/n).sqrt(), [0,1,2].map(|i| 1e3*worst[i]), worst[3], 1e3*(l.state.q[0]-l.wanted[0]),1e3*(l.state.q[1]-l.wanted[1]),1e3*(l.state.q[2]-l.wanted[2]), l.slipped.map(|x| x*1e3), slip_loaded.map(|x| x*1e3));
    }
}
