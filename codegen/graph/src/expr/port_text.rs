//! How programs write what is in their ports.

use super::Port;

/// The place of scalar `k` of a port: `h[2][3]`.
pub fn element(port: &Port, k: usize) -> String {
    let mut rest = k;
    let mut indices = Vec::new();
    for n in port.shape.iter().rev() {
        indices.push(rest % n);
        rest /= n;
    }
    let name = if port.wrapper.is_some() { format!("{}.0", port.name) } else { port.name.clone() };
    indices.iter().rev().fold(name, |text, i| format!("{text}[{i}]"))
}

/// Element k of ports that stand one after the other.
pub fn element_of(ports: &[Port], mut k: usize) -> String {
    for port in ports {
        if k < port.len() {
            return element(port, k);
        }
        k -= port.len();
    }
    panic!("an element beyond the ports");
}
