//! Where a frame is.

use straightline_core::Real;

/// Position and rotation of a frame B in a frame A, for frames of a robot the world: a point r_B stands at
/// r_A = p + R r_B.
/// ```
/// use straightline::Dynamics;
///
/// #[derive(Dynamics)]
/// #[robot("examples/arm.toml", functions(forward_kinematics), frames("upper_arm", "forearm"))]
/// struct Arm;
///
/// let mut poses = [[0.0; 12]; Arm::FRAME_NAMES.len()];
/// Arm::forward_kinematics(&[0.1, 0.2, 0.3], &mut poses);
/// let forearm = Arm::pose(&poses, Arm::FOREARM);
/// assert_eq!(forearm.position, poses[1][..3]);
///
/// // the forearm as the upper arm sees it, and back
/// let upper_arm = Arm::pose(&poses, Arm::UPPER_ARM);
/// let seen = upper_arm.inverse().compose(&forearm);
/// let back = upper_arm.transform_point(seen.position);
/// assert!((0..3).all(|i| (back[i] - forearm.position[i]).abs() < 1e-15));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose<T = f64> {
    /// p: the origin of B in axes of A \[m\].
    pub position: [T; 3],
    /// The rows of R, whose columns are the axes of B in those of A.
    pub rotation: [[T; 3]; 3],
}

impl<T: Copy> From<[T; 12]> for Pose<T> {
    /// Position, then the rotation by rows, as `forward_kinematics` gives them per frame.
    fn from(x: [T; 12]) -> Self {
        let [px, py, pz, xx, xy, xz, yx, yy, yz, zx, zy, zz] = x;
        Pose { position: [px, py, pz], rotation: [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] }
    }
}

impl<T: Copy> From<Pose<T>> for [T; 12] {
    fn from(pose: Pose<T>) -> Self {
        let Pose { position: [px, py, pz], rotation: [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] } = pose;
        [px, py, pz, xx, xy, xz, yx, yy, yz, zx, zy, zz]
    }
}

impl<T: Copy> Pose<T> {
    /// The columns of R: the axes x, y and z of B in those of A; what packages with matrices by columns take.
    pub fn axes(&self) -> [[T; 3]; 3] {
        [0, 1, 2].map(|j| self.rotation.map(|row| row[j]))
    }
}

impl<T: Real> Pose<T> {
    /// p + R r: the point r of B in axes of A, from A's origin \[m\].
    pub fn transform_point(&self, r: [T; 3]) -> [T; 3] {
        let turned = multiply(&self.rotation, r);
        [0, 1, 2].map(|i| self.position[i] + turned[i])
    }

    /// A in B: Rᵀ and −Rᵀ p.
    pub fn inverse(&self) -> Self {
        let rotation = self.axes();
        Pose { position: multiply(&rotation, self.position).map(|x| -x), rotation }
    }

    /// C in A, where `c_in_b` is C in B.
    pub fn compose(&self, c_in_b: &Pose<T>) -> Self {
        let axes = c_in_b.axes().map(|axis| multiply(&self.rotation, axis));
        Pose { position: self.transform_point(c_in_b.position), rotation: [0, 1, 2].map(|i| axes.map(|axis| axis[i])) }
    }
}

/// R r.
fn multiply<T: Real>(rotation: &[[T; 3]; 3], r: [T; 3]) -> [T; 3] {
    rotation.map(|row| row[0] * r[0] + row[1] * r[1] + row[2] * r[2])
}
