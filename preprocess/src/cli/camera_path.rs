//! `hroc-bake camera-path`.

use super::{Failure, say};
use crate::import::{self, CameraChoice, ImportedCamera};
use crate::outputs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Writes the way of a glTF camera as a camera path for `hroc run --path`: at rest, or as the file's
/// animations move it.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The .glb or .gltf file.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// Which camera, by its name or its node's; not needed where there is one.
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Which animation; not needed where one moves the camera.
    #[arg(long, value_name = "NAME")]
    animation: Option<String>,
    /// The file to write; - for stdout.
    #[arg(short, long, value_name = "FILE", default_value = "-")]
    output: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments {
        input,
        camera,
        animation,
        output,
    } = arguments;
    let choice = CameraChoice {
        camera: camera.as_deref(),
        animation: animation.as_deref(),
    };
    let is_stdout = output == Path::new("-");
    let refuse = |path: &Path, what: &str| {
        let outputs = [output.as_path()];
        outputs::refuse_inputs(&outputs, [path], what).map_err(Failure::usage)
    };
    if !is_stdout {
        refuse(input, "is an input")?;
    }
    let ImportedCamera { path, files } =
        import::camera_path(input, choice).map_err(Failure::file)?;
    let json = path.to_json();
    if is_stdout {
        return io::stdout()
            .lock()
            .write_all(json.as_bytes())
            .map_err(Failure::stdout);
    }
    for file in &files {
        refuse(file, "is a file that an input refers to")?;
    }
    path.save(output).map_err(|error| {
        Failure::file(format_args!(
            "{}: cannot be written: {error}; choose another place",
            output.display()
        ))
    })?;
    say(format_args!(
        "{}: {} keys, {:.2} s",
        output.display(),
        path.keys().len(),
        path.duration_s()
    ));
    Ok(())
}
