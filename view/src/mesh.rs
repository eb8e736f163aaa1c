//! Triangles from the files of meshes: STL, binary and as text, and OBJ. Nothing else of these files is read.

/// Corners of a triangle.
pub type Triangle = [[f32; 3]; 3];

/// The triangles of a file with this name, which is read only if its format is.
///
/// # Errors
/// What is wrong with it, or that its format is not read.
pub fn triangles(name: &str, read: impl FnOnce() -> Result<Vec<u8>, String>) -> Result<Vec<Triangle>, String> {
    let extension = name.rsplit_once('.').map(|(_, extension)| extension.to_ascii_lowercase()).unwrap_or_default();
    let found = match &*extension {
        "stl" => stl(&read()?)?,
        "obj" => obj(&String::from_utf8_lossy(&read()?))?,
        _ => return Err(format!("meshes in .{extension} are not drawn, STL and OBJ are")),
    };
    match found.iter().flatten().flatten().all(|x| x.is_finite()) {
        true if found.is_empty() => Err("there is no triangle in it".to_string()),
        true => Ok(found),
        false => Err("a corner is not a finite number".to_string()),
    }
}

/// Bytes of the head of a binary STL file, of the number of its triangles, and of each of them.
const STL_SIZES: [usize; 3] = [80, 4, 50];

fn stl(bytes: &[u8]) -> Result<Vec<Triangle>, String> {
    let [head, count, each] = STL_SIZES;
    if let Some(four) = bytes.get(head..head + count) {
        let triangles = u32::from_le_bytes([four[0], four[1], four[2], four[3]]) as usize;
        // a text may begin with any word; its length is not that of so many triangles
        if triangles.checked_mul(each).is_some_and(|size| size == bytes.len() - head - count) {
            return Ok(bytes[head + count..].chunks_exact(each).map(stl_triangle).collect());
        }
    }
    let text = std::str::from_utf8(bytes).ok().filter(|text| text.trim_start().starts_with("solid"));
    let text = text.ok_or("it is neither a binary STL file of its length nor one in text")?;
    let mut words = text.split_whitespace();
    let mut corners = Vec::new();
    while let Some(word) = words.next() {
        if word == "vertex" {
            corners
                .push(point(&mut words).ok_or_else(|| format!("corner {} has no three numbers", corners.len() + 1))?);
        }
    }
    match corners.len() % 3 {
        0 => Ok(corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect()),
        _ => Err(format!("{} corners are no triangles", corners.len())),
    }
}

/// Behind a normal of three numbers.
fn stl_triangle(bytes: &[u8]) -> Triangle {
    let number = |k: usize| f32::from_le_bytes([bytes[k], bytes[k + 1], bytes[k + 2], bytes[k + 3]]);
    [12, 24, 36].map(|corner| [0, 4, 8].map(|k| number(corner + k)))
}

fn point<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<[f32; 3]> {
    let mut next = || words.next()?.parse().ok();
    Some([next()?, next()?, next()?])
}

fn obj(text: &str) -> Result<Vec<Triangle>, String> {
    let (mut points, mut triangles): (Vec<[f32; 3]>, Vec<Triangle>) = (Vec::new(), Vec::new());
    for (k, line) in text.lines().enumerate() {
        let wrong = |what: &str| format!("line {}: {what}", k + 1);
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => points.push(point(&mut words).ok_or_else(|| wrong("a point has three numbers"))?),
            Some("f") => {
                let corner = |word: &str| {
                    // counted from 1, or backwards from the last one; textures and normals follow a slash
                    let index: i64 = word.split('/').next()?.parse().ok()?;
                    let index = if index < 0 { points.len() as i64 + index } else { index - 1 };
                    points.get(usize::try_from(index).ok()?).copied()
                };
                let corners: Option<Vec<[f32; 3]>> = words.map(corner).collect();
                let corners = corners
                    .filter(|c| c.len() >= 3)
                    .ok_or_else(|| wrong("a face has three points or more that stand above it"))?;
                triangles.extend(corners[1..].windows(2).map(|pair| [corners[0], pair[0], pair[1]]));
            }
            _ => {}
        }
    }
    Ok(triangles)
}
