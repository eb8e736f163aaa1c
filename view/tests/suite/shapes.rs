//! What robots look like: solids and meshes of a URDF.

use super::page::data;
use super::robots::{across, arm, at};
use straightline_core::model::{Frame, Model};
use straightline_view::{page, urdf_look, ShapeForm, ViewedLook, ViewedRun};

const STL: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0.1 0 0\nvertex 0 0.2 0\nendloop\nendfacet\nendsolid a\n";
const OBJ: &str = "# a\nv 0 0 0\nv 0.1 0 0\nv 0 0.2 0\nvn 0 0 1\nf 1//1 2//1 -1//1\n";

/// The triangle of both, in binary STL whose head begins as that of a text.
fn binary() -> Vec<u8> {
    let mut bytes = b"solid in binary".to_vec();
    bytes.resize(80, b' ');
    bytes.extend(1u32.to_le_bytes());
    let numbers = [0.0f32, 0.0, 1.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.2, 0.0];
    bytes.extend(numbers.into_iter().flat_map(f32::to_le_bytes));
    bytes.extend([0, 0]);
    bytes
}

fn robot() -> Model<f64> {
    let mut arm = arm();
    arm.frames.push(Frame { name: "upper".into(), body: Some(1), placement: at(across(), 0.02, 0.0, 0.1) });
    arm
}

/// The look of a link `upper` with this visual element.
fn look(visual: &str) -> ViewedLook {
    let text = format!("<robot name='a'><material name='blue'><color rgba='0 0.2 0.9 0.5'/></material><link name='upper'><visual>{visual}</visual></link></robot>");
    let read = |name: &str| match name {
        "text.stl" => Ok(STL.as_bytes().to_vec()),
        "binary.STL" => Ok(binary()),
        "short.stl" => Ok(binary()[..120].to_vec()),
        "a.obj" => Ok(OBJ.as_bytes().to_vec()),
        "far.obj" => Ok(OBJ.replace("-1//1", "7").into_bytes()),
        _ => Err("there is no such file".to_string()),
    };
    urdf_look(&text, &robot(), &read)
}

#[test]
fn a_shape_stands_where_its_link_and_its_origin_say() {
    let found = look("<origin xyz='0.1 0.2 0.3' rpy='0 0 1.5707963267948966'/><geometry><box size='1 2 3'/></geometry><material name='blue'/>");
    let [shape] = &found.shapes[..] else { panic!("{found:?}") };
    assert_eq!(
        (shape.body, &shape.form, shape.colour),
        (Some(1), &ShapeForm::Box([1.0, 2.0, 3.0]), Some([0.0, 0.2, 0.9, 0.5]))
    );
    // the link's frame is at (0.02, 0, 0.1), with its y along −z of the body and its z along y
    let origin = shape.placement.translation.to_array();
    assert!(origin.iter().zip([0.12, 0.3, -0.1]).all(|(a, b)| (a - b).abs() < 1e-15), "{origin:?}");
    // x of the box is y of the link
    let x = shape.placement.rotation.column(0).to_array();
    assert!(x.iter().zip([0.0, 0.0, -1.0]).all(|(a, b)| (a - b).abs() < 1e-15), "{x:?}");
}

#[test]
fn meshes_in_three_formats_are_the_same_triangle() {
    let form = |name: &str| {
        let found = look(&format!("<geometry><mesh filename='{name}' scale='1 -1 2'/></geometry>"));
        assert_eq!(found.notes, [""; 0]);
        found.shapes[0].form.clone()
    };
    let expected = ShapeForm::Mesh(vec![[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.2, 0.0]]], [1.0, -1.0, 2.0]);
    for name in ["text.stl", "binary.STL", "a.obj"] {
        assert_eq!(form(name), expected, "{name}");
    }
}

#[test]
fn what_is_not_drawn_is_named_with_its_reason() {
    for (visual, reason) in [
        (
            "<geometry><mesh filename='package://a/hand.dae'/></geometry>",
            "package://a/hand.dae: meshes in .dae are not drawn",
        ),
        ("<geometry><mesh filename='none.stl'/></geometry>", "none.stl: there is no such file"),
        (
            "<geometry><mesh filename='short.stl'/></geometry>",
            "short.stl: it is neither a binary STL file of its length",
        ),
        ("<geometry><mesh filename='far.obj'/></geometry>", "far.obj: line 6: a face has three points"),
        ("<geometry><box size='1 2'/></geometry>", "size is `1 2`, not 3 numbers"),
        ("<geometry><cylinder radius='1'/></geometry>", "<cylinder> has no length"),
        ("<geometry><capsule radius='1'/></geometry>", "<capsule> is no box"),
        ("", "it has no geometry"),
    ] {
        let found = look(visual);
        assert!(found.shapes.is_empty() && found.notes.len() == 1, "{found:?}");
        assert!(
            found.notes[0].starts_with("Link upper is not drawn as it looks: ") && found.notes[0].contains(reason),
            "{found:?}"
        );
    }
}

#[test]
fn a_page_has_the_shapes_and_says_what_is_missing() {
    let mut look = look("<geometry><mesh filename='a.obj'/></geometry>");
    look.notes.push("Link hand is not drawn as it looks: <b>.".to_string());
    let model = robot();
    let text = page(&model, &look, &ViewedRun::tour(&model), &[]).unwrap();
    assert!(!text.contains("<b>"));
    let data = data(&text);
    let shape = &data["shapes"][0];
    assert_eq!(
        (shape["form"].as_str(), shape["body"].as_u64(), shape["colour"].is_null()),
        (Some("mesh"), Some(1), true)
    );
    // nine numbers of four bytes are 48 characters
    assert_eq!(shape["triangles"].as_str().unwrap().len(), 48);
    assert_eq!(data["notes"][1], look.notes[0]);
}
