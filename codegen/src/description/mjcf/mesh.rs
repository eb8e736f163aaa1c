//! Meshes: volume, centre of mass and inertia of what triangles enclose, from STL (binary or text) and OBJ files.
//!
//! A triangle a, b, c and the origin span a tetrahedron of the volume V = a·(b × c)/6, whose ∫ r dm = V (a + b + c)/4 and
//! ∫ r rᵀ dm = V/20 (a aᵀ + b bᵀ + c cᵀ + s sᵀ), s = a + b + c, at density 1. With `inertia="exact"` volumes have
//! their sign. MuJoCo's default `legacy` takes their magnitudes, about the centroid of the surface for the centre of mass,
//! about that for mass and inertia: more than there is where a mesh is not convex. Both are followed.

use super::classes::Defaulted;
use super::files::{read_file, Attribute, Element};
use super::Mjcf;
use crate::description::angle;
use crate::description::geometry::vector;
use crate::description::merge::Part;
use crate::description::{messages, Rotation};
use std::path::{Path, PathBuf};
use straightline_core::spatial::{Mat3, Sym3, Vec3};
use straightline_core::Dd;

/// Corners of a triangle.
type Triangle = [Vec3<Dd>; 3];

/// Volumes below it are those of no body \[m³\].
const LEAST_VOLUME: f64 = 1e-60;

impl<'s> Mjcf<'s> {
    /// Volume, centre of mass and inertia at density 1 of a mesh; `None` after a complaint.
    pub fn read_mesh(&mut self, geom: &Defaulted<'s>, owner: &str) -> Option<Part> {
        let Some(name) = geom.attribute("mesh") else {
            self.complain_at(geom.element, messages::missing_attribute(owner, "mesh", "mesh=\"...\""));
            return None;
        };
        let Some(element) = self.mesh_named(name) else {
            let names: Vec<String> = self.meshes(name.scope).into_iter().map(|(name, _)| name).collect();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            self.complain(name, messages::unknown_word(&format!("mesh of {owner}"), &name.value, &names));
            return None;
        };
        let mesh = self.given_outermost(element, "mesh");
        let who = format!("mesh `{}`", name.value);
        let help = "write `<inertial>` in the body, or give the geom `mass=\"0\"`";
        let modes = &["exact", "legacy", "convex", "shell"];
        let usual = if self.settings[element.scope].exact_meshes { "exact" } else { "legacy" };
        let mode = mesh.attribute("inertia").and_then(|_| self.word(&mesh, "inertia", modes)).unwrap_or(usual);
        if ["convex", "shell"].contains(&mode) {
            self.refuse_attribute(element, "inertia", &who, "only `exact` and `legacy` are computed", help);
            return None;
        }
        let Some(file) = element.attribute("file") else {
            self.refuse(element, &who, "it is made of no file", help);
            return None;
        };
        let path = self.mesh_path(file);
        let bytes = read_file(&path);
        bytes.iter().for_each(|bytes| self.reader.diagnostics.note_file(&path, bytes));
        let read = bytes.and_then(|bytes| triangles(&path, &bytes));
        let mut faces = match read {
            Ok(faces) => faces,
            Err(why) => {
                self.complain(file, messages::mesh_failed(&file.value, &why));
                return None;
            }
        };
        self.place_mesh(&mesh, &who, &mut faces);
        let part = solid(&faces, mode == "exact");
        if part.is_none() {
            self.complain(file, messages::mesh_failed(&file.value, "it encloses no volume"));
        }
        part
    }

    /// The meshes of a model with their names: that which is given, or that of the file without its end.
    fn meshes(&self, scope: usize) -> Vec<(String, &'s Element)> {
        let files = self.files;
        let meshes = files
            .sections(scope, "asset")
            .into_iter()
            .flat_map(|section| files.children(section))
            .filter(|element| element.name == "mesh");
        let stem =
            |file: &str| Path::new(file).file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
        let name = |element: &Element| match (element.attribute("name"), element.attribute("file")) {
            (Some(name), _) => name.value.clone(),
            (None, Some(file)) => stem(&file.value.replace('\\', "/")),
            (None, None) => String::new(),
        };
        meshes.map(|element| (name(element), element)).collect()
    }

    fn mesh_named(&self, name: &Attribute) -> Option<&'s Element> {
        self.meshes(name.scope).into_iter().find(|(own, _)| *own == name.value).map(|(_, element)| element)
    }

    /// Where a file of a mesh is: in the folder of meshes, relative to that of the file that is read or attached.
    fn mesh_path(&self, named: &Attribute) -> PathBuf {
        let settings = &self.settings[named.scope];
        let file = named.value.trim().replace('\\', "/");
        let file = match (settings.strips_paths, file.rsplit_once('/')) {
            (true, Some((_, name))) => name.to_string(),
            _ => file,
        };
        let root = self.files.root(named.scope).file;
        let folder = self.files.sources[root].file().parent().map_or_else(PathBuf::new, Path::to_path_buf);
        folder.join(settings.mesh_folder.unwrap_or("").replace('\\', "/")).join(file)
    }

    /// Moves a mesh as its reference pose says, and scales it.
    fn place_mesh(&mut self, mesh: &Defaulted<'s>, owner: &str, faces: &mut [Triangle]) {
        let position = vector(self.some_numbers(mesh, "refpos", owner).unwrap_or([0.0; 3]));
        let turn = self.reference_turn(mesh, owner);
        let scale = vector(self.some_numbers(mesh, "scale", owner).unwrap_or([1.0; 3]));
        for corner in faces.iter_mut().flatten() {
            let moved = turn.transpose_mul(*corner - position);
            *corner = Vec3::new(moved.x * scale.x, moved.y * scale.y, moved.z * scale.z);
        }
    }

    fn reference_turn(&mut self, mesh: &Defaulted<'s>, owner: &str) -> Mat3<Dd> {
        let attribute = mesh.attribute("refquat");
        let numbers = self.some_numbers::<4>(mesh, "refquat", owner);
        match (attribute, numbers) {
            (Some(attribute), Some(numbers)) => {
                let turns = self.turns("quat", &numbers, attribute, owner);
                angle::rotation(&Rotation::Turns(turns), angle::ROUNDING)
            }
            _ => Mat3::identity(),
        }
    }
}

/// Volume, centre and inertia about it of what triangles enclose; `None` if that is nothing.
#[allow(clippy::assign_op_pattern)] // without the feature `reference` of core there is no `+=`
fn solid(faces: &[Triangle], is_exact: bool) -> Option<Part> {
    let volume_of = |[a, b, c]: Triangle| {
        let six = a.dot(b.cross(c));
        if is_exact {
            six / Dd::from(6.0)
        } else {
            six.abs() / Dd::from(6.0)
        }
    };
    let start = if is_exact { faces.first()?[0] } else { centroid(faces)? };
    let (mut volume, mut moment) = (Dd::ZERO, Vec3::zero());
    for face in faces {
        let [a, b, c] = face.map(|corner| corner - start);
        let own = volume_of([a, b, c]);
        volume = volume + own;
        moment = moment + (a + b + c).scale(own / Dd::from(4.0));
    }
    if volume.abs().to_f64() < LEAST_VOLUME {
        return None;
    }
    let com = start + moment.map(|x| x / volume);
    let mut second = Sym3::zero();
    volume = Dd::ZERO;
    for face in faces {
        let [a, b, c] = face.map(|corner| corner - com);
        let own = volume_of([a, b, c]);
        volume = volume + own;
        let own = own / Dd::from(20.0);
        let s = a + b + c;
        for v in [a, b, c, s] {
            let w = v.scale(own);
            second = second
                + Sym3 { xx: v.x * w.x, xy: v.x * w.y, xz: v.x * w.z, yy: v.y * w.y, yz: v.y * w.z, zz: v.z * w.z };
        }
    }
    // faces that look inwards give everything the other sign
    let sign = if volume.to_f64() < 0.0 { -Dd::ONE } else { Dd::ONE };
    let Sym3 { xx, xy, xz, yy, yz, zz } = second.map(|x| x * sign);
    let inertia_com = Sym3 { xx: yy + zz, yy: xx + zz, zz: xx + yy, xy: -xy, xz: -xz, yz: -yz };
    Some(Part { mass: volume * sign, com, inertia_com })
}

/// The centroid of a surface.
#[allow(clippy::assign_op_pattern)] // likewise
fn centroid(faces: &[Triangle]) -> Option<Vec3<Dd>> {
    let (mut area, mut moment) = (Dd::ZERO, Vec3::zero());
    for [a, b, c] in faces {
        let across = (*b - *a).cross(*c - *a);
        let own = across.dot(across).sqrt();
        area = area + own;
        moment = moment + (*a + *b + *c).scale(own / Dd::from(3.0));
    }
    (area.to_f64() > 0.0).then(|| moment.map(|x| x / area))
}

/// The triangles of a file, or why there are none.
fn triangles(path: &Path, bytes: &[u8]) -> Result<Vec<Triangle>, String> {
    let end = path.extension().map_or(String::new(), |end| end.to_string_lossy().to_ascii_lowercase());
    let faces = match end.as_str() {
        "stl" => binary_stl(bytes).or_else(|| text_stl(bytes)).ok_or("it is no STL file")?,
        "obj" => obj(bytes)?,
        _ => return Err("only STL and OBJ files are read".to_string()),
    };
    let is_fit = |corner: &Vec3<Dd>| corner.to_array().iter().all(|x| x.to_f64().abs() <= 1e12);
    match faces.iter().flatten().all(is_fit) {
        true if faces.is_empty() => Err("it has no triangles".to_string()),
        true => Ok(faces),
        false => Err("a coordinate is beyond any robot, or no number".to_string()),
    }
}

/// 80 bytes, the number of triangles, and of each 12 numbers, its normal first, and 2 bytes.
fn binary_stl(bytes: &[u8]) -> Option<Vec<Triangle>> {
    let count = u32::from_le_bytes(bytes.get(80..84)?.try_into().ok()?) as usize;
    if count.checked_mul(50)?.checked_add(84)? != bytes.len() {
        return None;
    }
    let number = |at: &[u8]| f64::from(f32::from_le_bytes([at[0], at[1], at[2], at[3]]));
    let corner = |at: &[u8]| vector([number(&at[0..]), number(&at[4..]), number(&at[8..])]);
    let face = |face: &[u8]| [corner(&face[12..24]), corner(&face[24..36]), corner(&face[36..48])];
    Some(bytes[84..].chunks_exact(50).map(face).collect())
}

/// Three lines `vertex x y z` a triangle.
fn text_stl(bytes: &[u8]) -> Option<Vec<Triangle>> {
    let text = std::str::from_utf8(bytes).ok()?;
    if !text.trim_start().starts_with("solid") {
        return None;
    }
    let mut corners = Vec::new();
    for line in text.lines() {
        if let Some(rest) = line.trim().strip_prefix("vertex") {
            corners.push(three(rest)?);
        }
    }
    Some(corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect())
}

/// Lines `v x y z` and `f i j k …`, whose numbers count vertices from 1, or from the last one backwards. As MuJoCo has it, coordinates are f32, as in STL, and
/// the shorter diagonal of a face of four corners divides it, the second one where they are as long.
fn obj(bytes: &[u8]) -> Result<Vec<Triangle>, String> {
    let text = String::from_utf8_lossy(bytes);
    let mut vertices: Vec<Vec3<Dd>> = Vec::new();
    let mut faces = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let complaint = || format!("its line {} says no vertex or face", i + 1);
        let (word, rest) = line.trim().split_once(char::is_whitespace).unwrap_or((line.trim(), ""));
        match word {
            "v" => vertices.push(three(rest).ok_or_else(complaint)?.map(|x| Dd::from(f64::from(x.to_f64() as f32)))),
            "f" => {
                let corner = |word: &str| {
                    let index: i64 = word.split('/').next()?.parse().ok()?;
                    let index = if index < 0 { vertices.len() as i64 + index } else { index - 1 };
                    vertices.get(usize::try_from(index).ok()?).copied()
                };
                let corners: Option<Vec<Vec3<Dd>>> = rest.split_whitespace().map(corner).collect();
                let corners = corners.filter(|corners| corners.len() >= 3).ok_or_else(complaint)?;
                match corners[..] {
                    [a, b, c, d] if (a - c).dot(a - c).to_f64() >= (b - d).dot(b - d).to_f64() => {
                        faces.extend([[a, b, d], [b, c, d]]);
                    }
                    _ => faces.extend(corners[1..].windows(2).map(|pair| [corners[0], pair[0], pair[1]])),
                }
            }
            _ => {}
        }
    }
    Ok(faces)
}

fn three(text: &str) -> Option<Vec3<Dd>> {
    let mut numbers = text.split_whitespace().map(str::parse::<f64>);
    let mut next = || numbers.next().and_then(Result::ok);
    Some(vector([next()?, next()?, next()?]))
}
