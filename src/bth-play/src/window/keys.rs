//! The keys of the window.

use crate::args::Mode;
use winit::keyboard::KeyCode;

/// The list of keys that H prints. The README and the help of the program promise these keys.
pub(crate) const HELP: &str = "\
1 2 3 4 5 6 7   mode: shaded, normals, ao, steps, path, instances, clay
Space           play, pause
Left, Right     one frame back, on; Shift: ten
Home, End       first, last frame; or drag the bar at the bottom
drag            orbit around what is in the middle of the picture
right drag      move sideways (also Shift and drag)
wheel           nearer, farther
W S A D E Q     fly forwards, backwards, left, right, up, down; Shift: faster
C               next camera of the scene
R               the camera of the beginning
P               pause, and write the picture to a file once it is refined
H               print this
Escape          close
";

/// What pressing a key does at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Action {
    Mode(Mode),
    TogglePlayback,
    Step(i32),
    First,
    Last,
    NextCamera,
    Reset,
    Save,
    Help,
    Close,
}

/// The action of a key. Keys are identified by their position, named as on a keyboard of the United
/// States.
pub(crate) fn action(key: KeyCode, shift: bool) -> Option<Action> {
    let step = if shift { 10 } else { 1 };
    Some(match key {
        KeyCode::Digit1 | KeyCode::Numpad1 => Action::Mode(Mode::Shaded),
        KeyCode::Digit2 | KeyCode::Numpad2 => Action::Mode(Mode::Normals),
        KeyCode::Digit3 | KeyCode::Numpad3 => Action::Mode(Mode::Ao),
        KeyCode::Digit4 | KeyCode::Numpad4 => Action::Mode(Mode::Steps),
        KeyCode::Digit5 | KeyCode::Numpad5 => Action::Mode(Mode::Path),
        KeyCode::Digit6 | KeyCode::Numpad6 => Action::Mode(Mode::Instances),
        KeyCode::Digit7 | KeyCode::Numpad7 => Action::Mode(Mode::Clay),
        KeyCode::Space => Action::TogglePlayback,
        KeyCode::ArrowLeft => Action::Step(-step),
        KeyCode::ArrowRight => Action::Step(step),
        KeyCode::Home => Action::First,
        KeyCode::End => Action::Last,
        KeyCode::KeyC => Action::NextCamera,
        KeyCode::KeyR => Action::Reset,
        KeyCode::KeyP => Action::Save,
        KeyCode::KeyH => Action::Help,
        KeyCode::Escape => Action::Close,
        _ => return None,
    })
}

/// The direction in which the camera moves while a key is down: right, up, forward.
pub(crate) fn fly_direction(key: KeyCode) -> Option<[f64; 3]> {
    Some(match key {
        KeyCode::KeyW => [0.0, 0.0, 1.0],
        KeyCode::KeyS => [0.0, 0.0, -1.0],
        KeyCode::KeyD => [1.0, 0.0, 0.0],
        KeyCode::KeyA => [-1.0, 0.0, 0.0],
        KeyCode::KeyE => [0.0, 1.0, 0.0],
        KeyCode::KeyQ => [0.0, -1.0, 0.0],
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::ValueEnum;

    #[test]
    fn help_names_every_mode_in_the_order_of_its_keys() {
        let names: Vec<String> = Mode::value_variants().iter().map(|m| m.name()).collect();
        assert!(HELP.contains(&names.join(", ")), "{HELP}");
        assert_eq!(action(KeyCode::Digit4, false), Some(Action::Mode(Mode::Steps)));
        assert_eq!(action(KeyCode::ArrowLeft, true), Some(Action::Step(-10)));
    }
}
