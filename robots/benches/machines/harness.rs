// What runs the functions of the robots beside it: `ROBOTS` stands for a line per robot, `EXTERNS` for what is called that is not Rust's.
// Numbers are made of integers, so that they are the same on every machine.

#[path = "STARTUP"]
mod startup;

mod harness {
    use core::hint::black_box;

    extern "C" {
    EXTERNS
    }

    struct Numbers(u64);

    impl Numbers {
        fn next(&mut self) -> f32 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((self.0 >> 40) as i32 - (1 << 23)) as f32 * (1.0 / 8_388_608.0)
        }

        fn fill(&mut self, size: f32, x: &mut [f32]) {
            x.iter_mut().for_each(|x| *x = size * self.next());
        }
    }

    /// The next state; of a floating robot with a quaternion of length one.
    fn next_state(numbers: &mut Numbers, state: u64, [q, qd, qdd]: [&mut [f32]; 3]) {
        let floats = q.len() > qd.len();
        numbers.fill(3.0, q);
        numbers.fill(2.0, qd);
        numbers.fill(5.0, qdd);
        if floats {
            let turned = [[0.6, 0.0, 0.0, 0.8], [0.0, 0.6, 0.0, 0.8], [0.0, 0.0, 0.6, 0.8], [0.5, -0.5, 0.5, 0.5]];
            for (q, turned) in q[3..7].iter_mut().zip(turned[state as usize % 4]) {
                *q = turned;
            }
        }
    }

    fn hashed(hash: u32, x: &[f32]) -> u32 {
        let bytes = x.iter().flat_map(|x| x.to_bits().to_le_bytes());
        bytes.fold(hash, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(16_777_619))
    }

    macro_rules! run {
        ($robot:ident) => {
            #[inline(never)]
            pub fn $robot() {
                use super::$robot as robot;
                let (mut numbers, mut hash) = (Numbers(7), [0x811c_9dc5u32; 5]);
                for state in 0..STATES {
                    let (mut q, mut qd, mut qdd) = ([0.0; robot::NQ], [0.0; robot::NV], [0.0; robot::NV]);
                    next_state(&mut numbers, state, [&mut q, &mut qd, &mut qdd]);
                    let (mut y, mut h) = ([0.5; robot::NV], [[0.5; robot::NV]; robot::NV]);
                    // through pointers, so that nothing is inlined
                    black_box::<fn(&_, &_, &_, &mut _)>(robot::inverse_dynamics)(&q, &qd, &qdd, &mut y);
                    hash[0] = hashed(hash[0], &y);
                    black_box::<fn(&_, &mut _)>(robot::gravity_force)(&q, &mut y);
                    hash[1] = hashed(hash[1], &y);
                    black_box::<fn(&_, &mut _)>(robot::mass_matrix)(&q, &mut h);
                    hash[2] = h.iter().fold(hash[2], |hash, row| hashed(hash, row));
                    black_box::<fn(&_, &_, &_, &mut _)>(robot::forward_dynamics)(&q, &qd, &qdd, &mut y);
                    hash[3] = hashed(hash[3], &y);
                    black_box::<fn(&_, &mut _, &mut _)>(robot::mass_matrix_and_gravity_force)(&q, &mut h, &mut y);
                    hash[4] = h.iter().fold(hashed(hash[4], &y), |hash, row| hashed(hash, row));
                }
                hash.iter().for_each(|hash| super::startup::say(stringify!($robot), *hash));
            }
        };
    }

    macro_rules! run_derivatives {
        ($robot:ident) => {
            #[inline(never)]
            pub fn $robot() {
                use super::$robot as robot;
                let (mut numbers, mut hash) = (Numbers(7), [0x811c_9dc5u32; 4]);
                for state in 0..STATES {
                    let (mut q, mut qd, mut qdd) = ([0.0; robot::NQ], [0.0; robot::NV], [0.0; robot::NV]);
                    next_state(&mut numbers, state, [&mut q, &mut qd, &mut qdd]);
                    let (mut tau, mut blocks) = ([0.5; robot::NV], [[[0.5; robot::NV]; robot::NV]; 3]);
                    let [k, d, h] = &mut blocks;
                    black_box::<fn(&_, &_, &_, &mut _, &mut _, &mut _, &mut _)>(robot::inverse_dynamics_derivatives)(
                        &q, &qd, &qdd, k, d, h, &mut tau,
                    );
                    for (hash, block) in hash.iter_mut().zip(&blocks) {
                        *hash = block.iter().fold(*hash, |hash, row| hashed(hash, row));
                    }
                    hash[3] = hashed(hash[3], &tau);
                }
                hash.iter().for_each(|hash| super::startup::say(stringify!($robot), *hash));
            }
        };
    }

    /// Inverse dynamics beside a function in C of the same inputs and results: how far they are apart, in parts of the greatest torque.
    macro_rules! compare {
        ($robot:ident, $other:ident) => {
            #[inline(never)]
            pub fn $robot() {
                use super::$robot as robot;
                let mut numbers = Numbers(7);
                let (mut off, mut most) = (0.0f32, 0.0f32);
                for state in 0..STATES {
                    let (mut q, mut qd, mut qdd) = ([0.0; robot::NQ], [0.0; robot::NV], [0.0; robot::NV]);
                    next_state(&mut numbers, state, [&mut q, &mut qd, &mut qdd]);
                    let (mut own, mut other) = ([0.5; robot::NV], [0.5; robot::NV]);
                    black_box::<fn(&_, &_, &_, &mut _)>(robot::inverse_dynamics)(&q, &qd, &qdd, &mut own);
                    // SAFETY: arrays of NQ and NV numbers, as the file in C has them
                    unsafe { $other(q.as_ptr(), qd.as_ptr(), qdd.as_ptr(), other.as_mut_ptr()) };
                    let magnitude = |x: f32| f32::from_bits(x.to_bits() & 0x7fff_ffff);
                    for (own, other) in own.iter().zip(other) {
                        let difference = magnitude(own - other);
                        // what is no number stays
                        off = if difference <= off || off.is_nan() { off } else { difference };
                        most = most.max(magnitude(*own));
                    }
                }
                super::startup::say(stringify!($robot), (off / most).to_bits());
            }
        };
    }

    ROBOTS
}
