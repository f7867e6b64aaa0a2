//! Result files: opened before the work begins, in place only when they are complete.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use hroc_format::{file_to_replace, folder_of};
use hroc_preprocess::outputs;
use tempfile::NamedTempFile;

use crate::error::StudyError;

/// A file that appears under its name when it is complete, and not at all otherwise.
#[derive(Debug)]
pub struct OutputFile {
    path: PathBuf,
    /// Where `path` leads to.
    target: PathBuf,
    temporary: NamedTempFile,
}

impl OutputFile {
    /// Makes sure that `path` can be written, before time is spent on its contents. A symbolic link stays one: its
    /// target is replaced.
    ///
    /// # Errors
    /// If it cannot, or is no [file to replace](file_to_replace).
    pub fn create(path: &Path) -> Result<Self, StudyError> {
        let target = file_to_replace(path).map_err(StudyError::output(path))?;
        let mut builder = tempfile::Builder::new();
        builder.prefix(".hroc-").suffix(".tmp");
        #[cfg(unix)]
        {
            // As any file, less what the umask takes; temporary files are private otherwise.
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let temporary = builder
            .tempfile_in(folder_of(&target))
            .map_err(StudyError::output(path))?;
        Ok(Self {
            path: path.into(),
            target,
            temporary,
        })
    }

    /// Writes the contents and puts the file in place.
    ///
    /// # Errors
    /// If the disk is full or the place was taken away.
    pub fn finish(self, contents: &[u8]) -> Result<(), StudyError> {
        self.put(contents, true)
    }

    /// Like [`finish`](Self::finish), without the wait for the disk: after a power failure the file may be there
    /// without its contents. For what is checked when it is read, and can be made again.
    ///
    /// # Errors
    /// Likewise.
    pub fn finish_unsynced(self, contents: &[u8]) -> Result<(), StudyError> {
        self.put(contents, false)
    }

    fn put(self, contents: &[u8], sync: bool) -> Result<(), StudyError> {
        let Self {
            path,
            target,
            mut temporary,
        } = self;
        let written = temporary.write_all(contents).and_then(|()| {
            if sync {
                temporary.as_file().sync_all()?;
            }
            temporary.persist(target).map_err(|error| error.error)
        });
        written.map(drop).map_err(StudyError::output(path))
    }
}

/// A folder that takes result files.
///
/// # Errors
/// If it cannot be made.
pub fn create_folder(path: &Path) -> Result<(), StudyError> {
    fs::create_dir_all(path).map_err(StudyError::output(path))?;
    // A file in it shows whether it can be written to.
    OutputFile::create(&path.join("probe")).map(drop)
}

/// Refuses outputs that are one of the `inputs`, or one file twice. Each output comes with the option that names it.
///
/// # Errors
/// If there is one.
pub fn keep_inputs(inputs: &[&Path], outputs: &[(&str, &Path)]) -> Result<(), StudyError> {
    let paths: Vec<&Path> = outputs.iter().map(|(_, path)| *path).collect();
    outputs::refuse_inputs(&paths, inputs.iter().copied(), IS_INPUT)
        .and_then(|()| outputs::refuse_repetitions(outputs))
        .map_err(StudyError::Usage)
}

/// Refuses a folder for results in which one of the `inputs` has a name that `is_written`.
///
/// # Errors
/// If there is one.
pub fn keep_inputs_in(
    folder: &Path,
    inputs: &[&Path],
    is_written: impl Fn(&str) -> bool,
) -> Result<(), StudyError> {
    // A folder that is not there holds no input; one that cannot be listed is refused when it is written to.
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.filter(|entry| entry.file_name().to_str().is_some_and(&is_written));
    for path in names.map(|entry| entry.path()) {
        outputs::refuse_inputs(&[&path], inputs.iter().copied(), IS_INPUT)
            .map_err(StudyError::Usage)?;
    }
    Ok(())
}

const IS_INPUT: &str = "is an input";

/// The PNG file of `Rgba8UnormSrgb` texels, rows from the top.
pub fn png(texels: &[u8], [width, height]: [u32; 2]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header().expect("a header into memory");
    writer
        .write_image_data(texels)
        .expect("as many texels as the header says");
    writer.finish().expect("the end of a file in memory");
    file
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;

    #[test]
    fn a_file_appears_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("result.json");
        let entries = || fs::read_dir(folder.path()).unwrap().count();
        drop(OutputFile::create(&path).unwrap());
        assert_eq!(entries(), 0);
        OutputFile::create(&path).unwrap().finish(b"one").unwrap();
        OutputFile::create(&path).unwrap().finish(b"two").unwrap();
        assert_eq!(
            (fs::read(&path).unwrap().as_slice(), entries()),
            (&b"two"[..], 1)
        );
    }

    #[test]
    fn places_that_cannot_be_written_are_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        for path in [
            folder.path().to_path_buf(),
            folder.path().join("none/x.json"),
            PathBuf::from("/"),
        ] {
            let error = OutputFile::create(&path).unwrap_err();
            assert!(error.to_string().contains("cannot write it"), "{error}");
        }
        let file = folder.path().join("file");
        fs::write(&file, b"").unwrap();
        assert!(create_folder(&file.join("dump")).is_err());
        create_folder(&folder.path().join("a/b")).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_and_devices_and_pipes_are_refused() {
        use std::os::fd::AsRawFd;
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let [link, file] = ["link.json", "file.json"].map(|name| folder.path().join(name));
        symlink("file.json", &link).unwrap();
        assert!(OutputFile::create(&link).is_err(), "a link to nothing");
        fs::write(&file, b"old").unwrap();
        OutputFile::create(&link).unwrap().finish(b"new").unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read(&file).unwrap(), b"new");

        let null = folder.path().join("null");
        symlink("/dev/null", &null).unwrap();
        let (_reader, pipe) = io::pipe().unwrap();
        let pipe_path = PathBuf::from(format!("/dev/fd/{}", pipe.as_raw_fd()));
        for path in [null, PathBuf::from("/dev/null"), pipe_path] {
            let error = OutputFile::create(&path).unwrap_err().to_string();
            let parts = [path.to_str().unwrap(), "device or a pipe", "another place"];
            assert!(parts.iter().all(|part| error.contains(part)), "{error}");
        }
    }

    #[test]
    fn a_png_reads_back() {
        let texels = (0..24).collect::<Vec<u8>>();
        let file = png(&texels, [3, 2]);
        let mut reader = png::Decoder::new(io::Cursor::new(file))
            .read_info()
            .unwrap();
        let mut back = vec![0; 24];
        let info = reader.next_frame(&mut back).unwrap();
        assert_eq!((info.width, info.height, back), (3, 2, texels));
    }
}
