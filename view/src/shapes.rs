//! How a robot looks: the `<visual>` elements of its URDF, each at the body that carries its link.

use crate::mesh::{triangles, Triangle};
use roxmltree::{Document, Node};
use straightline_core::model::Model;
use straightline_core::spatial::{Mat3, Transform, Vec3};

/// Triangles of all meshes together; a page of more is slow.
const MOST_TRIANGLES: usize = 400_000;

/// What a robot looks like, and what of that is not drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViewedLook {
    /// Its solids.
    pub shapes: Vec<ViewedShape>,
    /// What was skipped, and why.
    pub notes: Vec<String>,
}

/// A solid at a body.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewedShape {
    /// The body that carries it; `None`: the world.
    pub body: Option<usize>,
    /// Its pose in the body's canonical frame, or in the world.
    pub placement: Transform<f64>,
    /// What it is.
    pub form: ShapeForm,
    /// Red, green, blue and opacity from 0 to 1, where the file says them.
    pub colour: Option<[f64; 4]>,
}

/// Solids about their own origin \[m\].
#[derive(Clone, Debug, PartialEq)]
pub enum ShapeForm {
    /// Edges along x, y and z.
    Box([f64; 3]),
    /// Along z.
    Cylinder {
        /// Its radius.
        radius: f64,
        /// From end to end.
        length: f64,
    },
    /// Its radius.
    Sphere(f64),
    /// Triangles, scaled along x, y and z.
    Mesh(Vec<Triangle>, [f64; 3]),
}

/// The visual elements of a URDF; `read` gives the bytes of a mesh by the name that the file has for it. A text that is no URDF has none.
pub fn urdf_look(text: &str, model: &Model<f64>, read: &dyn Fn(&str) -> Result<Vec<u8>, String>) -> ViewedLook {
    let mut look = ViewedLook::default();
    let Ok(document) = Document::parse(text) else { return look };
    let root = document.root_element();
    let mut left = MOST_TRIANGLES;
    for link in root.children().filter(|node| node.has_tag_name("link")) {
        let name = link.attribute("name").unwrap_or("");
        for visual in link.children().filter(|node| node.has_tag_name("visual")) {
            match shape(root, visual, model, name, read) {
                Ok(ViewedShape { form: ShapeForm::Mesh(mesh, _), .. }) if mesh.len() > left => {
                    look.notes.push(format!(
                        "Link {name}: a mesh of {} triangles is left out, a page has {MOST_TRIANGLES} at most.",
                        mesh.len()
                    ));
                }
                Ok(shape) => {
                    left -= if let ShapeForm::Mesh(mesh, _) = &shape.form { mesh.len() } else { 0 };
                    look.shapes.push(shape);
                }
                Err(why) => look.notes.push(format!("Link {name} is not drawn as it looks: {why}.")),
            }
        }
    }
    look
}

fn child<'a, 'b>(of: Node<'a, 'b>, name: &str) -> Option<Node<'a, 'b>> {
    of.children().find(|node| node.has_tag_name(name))
}

/// So many finite numbers of an attribute.
fn numbers<const N: usize>(of: Node, attribute: &str) -> Result<Option<[f64; N]>, String> {
    let Some(text) = of.attribute(attribute) else { return Ok(None) };
    let found: Option<Vec<f64>> =
        text.split_whitespace().map(|word| word.parse().ok().filter(|x: &f64| x.is_finite())).collect();
    let found = found.and_then(|found| found.try_into().ok());
    found.map(Some).ok_or_else(|| format!("{attribute} is `{text}`, not {N} numbers"))
}

fn needed<const N: usize>(of: Node, attribute: &str) -> Result<[f64; N], String> {
    numbers(of, attribute)?.ok_or_else(|| format!("<{}> has no {attribute}", of.tag_name().name()))
}

fn shape(
    root: Node,
    visual: Node,
    model: &Model<f64>,
    link: &str,
    read: &dyn Fn(&str) -> Result<Vec<u8>, String>,
) -> Result<ViewedShape, String> {
    let frame = model.frame(link).ok_or("it is no link of the robot in this scene")?;
    let geometry = child(visual, "geometry").and_then(|node| node.children().find(Node::is_element));
    let geometry = geometry.ok_or("it has no geometry")?;
    let form = match geometry.tag_name().name() {
        "box" => ShapeForm::Box(needed(geometry, "size")?),
        "cylinder" => ShapeForm::Cylinder {
            radius: needed::<1>(geometry, "radius")?[0],
            length: needed::<1>(geometry, "length")?[0],
        },
        "sphere" => ShapeForm::Sphere(needed::<1>(geometry, "radius")?[0]),
        "mesh" => {
            let name = geometry.attribute("filename").ok_or("<mesh> has no filename")?;
            let scale = numbers(geometry, "scale")?.unwrap_or([1.0; 3]);
            let mesh = triangles(name, || read(name));
            ShapeForm::Mesh(mesh.map_err(|why| format!("{name}: {why}"))?, scale)
        }
        other => return Err(format!("<{other}> is no box, cylinder, sphere or mesh")),
    };
    let origin = match child(visual, "origin") {
        None => Transform::identity(),
        Some(origin) => Transform {
            rotation: roll_pitch_yaw(numbers(origin, "rpy")?.unwrap_or_default()),
            translation: Vec3::from(numbers(origin, "xyz")?.unwrap_or_default()),
        },
    };
    let placement = frame.placement.compose(&origin);
    Ok(ViewedShape { body: frame.body, placement, form, colour: colour(root, visual)? })
}

/// Of the element itself, or of the robot's material of that name.
fn colour(root: Node, visual: Node) -> Result<Option<[f64; 4]>, String> {
    let Some(own) = child(visual, "material") else { return Ok(None) };
    let is_named = |node: &Node| node.has_tag_name("material") && node.attribute("name") == own.attribute("name");
    let found =
        child(own, "color").or_else(|| root.children().find(is_named).and_then(|material| child(material, "color")));
    let rgba = found.map(|node| needed::<4>(node, "rgba")).transpose()?;
    Ok(rgba.map(|rgba| rgba.map(|x| x.clamp(0.0, 1.0))))
}

/// R_z(yaw) R_y(pitch) R_x(roll), as URDF defines it.
fn roll_pitch_yaw([roll, pitch, yaw]: [f64; 3]) -> Mat3<f64> {
    let about_z = Mat3::about_z(yaw.sin(), yaw.cos());
    let (s, c) = pitch.sin_cos();
    let about_y = Mat3 { rows: [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]] };
    let (s, c) = roll.sin_cos();
    let about_x = Mat3 { rows: [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]] };
    about_z * about_y * about_x
}
