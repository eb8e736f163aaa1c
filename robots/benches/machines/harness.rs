// What runs the functions of the robots beside it: `ROBOTS` stands for a line per robot. Numbers are made of integers, so that they are the same
// on every machine.

#[path = "STARTUP"]
mod startup;

mod harness {
    use core::hint::black_box;

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
                    numbers.fill(3.0, &mut q);
                    numbers.fill(2.0, &mut qd);
                    numbers.fill(5.0, &mut qdd);
                    if robot::NQ > robot::NV {
                        let turned = [[0.6, 0.0, 0.0, 0.8], [0.0, 0.6, 0.0, 0.8], [0.0, 0.0, 0.6, 0.8], [0.5, -0.5, 0.5, 0.5]];
                        for (q, turned) in q[3..7].iter_mut().zip(turned[state as usize % 4]) {
                            *q = turned;
                        }
                    }
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

    ROBOTS
}
