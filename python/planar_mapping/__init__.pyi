"""Planar surface-based 3D maps: clouds and depth images in, oriented cuboids out.

Lengths are metres. Points of a cloud are in the sensor's frame; T, a 4 x 4 matrix T_world_sensor, maps them to the world
(z up); a camera's frame has x right, y down, z forward. Maps and their answers are in the world. Functions that take
long release the interpreter's lock; a map may be used from several threads.

Wrong shapes, sizes and values raise InputError or ParameterError (both are ValueError), wrong types TypeError,
files IoError (an OSError).
"""
from os import PathLike
from typing import Any, Callable, Mapping, Optional, Union
from typing import Sequence as _Sequence

import numpy as np
import numpy.typing as npt

__version__: str

FREE: int
OCCUPIED: int
UNKNOWN: int

_Array = npt.NDArray[Any]
_Path = Union[str, "PathLike[str]"]

class Error(Exception):
    """Whatever planar_mapping raises on purpose."""

class InputError(Error, ValueError):
    """Input that cannot be used: a wrong shape, a pose that is no rigid motion, sizes that disagree."""

class ParameterError(Error, ValueError):
    """A parameter outside its range; the message says the range and the unit."""

class ConfigError(Error, ValueError):
    """A bad configuration."""

    problems: list[str]
    """Every problem as file:line:col: ..."""

class IoError(Error, OSError):
    """A file that cannot be read or written."""

class MissingFileError(IoError, FileNotFoundError):
    """There is no such file, or no such directory to write to."""

class OutputExistsError(IoError, FileExistsError):
    """run() found earlier results, and neither overwrite nor resume was given."""

class FrameUpdate:
    """What an insertion did."""

    @property
    def planes_new(self) -> int: ...
    @property
    def planes_matched(self) -> int: ...
    @property
    def planes_merged(self) -> int: ...
    @property
    def cells_added(self) -> int: ...
    @property
    def cells_removed(self) -> int: ...
    @property
    def dropped_points(self) -> int:
        """Not finite, beyond the world, or too few in their cell."""

class Segmentation:
    """The planes of a cloud, largest first."""

    @property
    def planes(self) -> _Array:
        """Fields normal (3, towards the sensor), offset, rms, inliers (their number): normal . p + offset = 0."""
    @property
    def labels(self) -> npt.NDArray[np.int32]:
        """The plane of each point, -1 = none: (N) or (H, W)."""
    def inliers(self, plane: int) -> npt.NDArray[np.int32]:
        """Indices of the points of a plane, ascending; rows of an organized cloud one after the other. Read only."""
    def __len__(self) -> int: ...

class Robot:
    """The robot that a plan is made for; metres, radians."""

    height: float
    radius: float
    max_step: float
    max_slope: float
    camera_height: float
    def __init__(
        self,
        *,
        height: float = ...,
        radius: float = ...,
        max_step: float = ...,
        max_slope: float = ...,
        camera_height: float = ...,
    ) -> None: ...

class Plan:
    """A storey from above: rows of cells, the row of smallest y first; 0 free, 100 occupied, -1 unknown."""

    @property
    def cell(self) -> float: ...
    @property
    def floor(self) -> float: ...
    @property
    def note(self) -> str: ...
    @property
    def origin(self) -> tuple[float, float]:
        """The lower left corner of cell [0, 0]."""
    @property
    def values(self) -> npt.NDArray[np.int8]: ...
    @property
    def heights(self) -> npt.NDArray[np.float32]: ...
    def distances(self) -> npt.NDArray[np.float32]: ...
    def is_standable(self, x: float, y: float) -> bool: ...

class PlanarMap:
    """A map of planar cuboids: what is occupied, free and unknown.

    What methods return are copies: later insertions do not change them.
    """

    def __init__(
        self,
        resolution: Optional[float] = None,
        *,
        profile: str = "compact",
        max_range: float = 0.0,
        up: Optional[npt.ArrayLike] = None,
        unknown_space: bool = True,
        unseen: Optional[str] = None,
        min_probability: Optional[float] = None,
        threads: int = 1,
    ) -> None:
        """resolution: side of the smallest cell; None = from the first cloud, as single_pcd.yaml. up: None = z for clouds
        with a pose T, else from the first cloud. profile: compact or paper. max_range: frames say nothing of space
        beyond; 0 = as far as the sensor measures. unknown_space: keep track of free and unknown space. unseen: what space
        is that was never observed, unknown or free. min_probability: cells believed less are removed; both None = as the
        profile has it. threads: 0 = all cores."""
    @staticmethod
    def load(path: _Path) -> PlanarMap:
        """Reads a .pmap file; the map uses all cores."""
    def save(self, path: _Path, *, overwrite: bool = False) -> None:
        """Writes a .pmap file, whole or not at all."""
    def export(
        self,
        path: _Path,
        *,
        unknown: bool = False,
        cell: float = 0.0,
        robot: Robot = ...,
        distance: bool = False,
        surface: bool = False,
        spacing: float = 0.0,
        frame_id: str = "map",
        overwrite: bool = False,
    ) -> None:
        """Writes a file for other programs; its extension is the format, and the arguments are the options, of
        `planar_map convert`."""
    def insert(
        self,
        xyz: npt.ArrayLike,
        T: Optional[npt.ArrayLike] = None,
        *,
        planes: Optional[Segmentation] = None,
        distance_threshold: Optional[float] = None,
        min_inliers: Optional[int] = None,
        timestamp: float = 0.0,
        K: Optional[npt.ArrayLike] = None,
        origin: Optional[npt.ArrayLike] = None,
    ) -> FrameUpdate:
        """Adds a cloud: (N, 3), or (H, W, 3) if it is organized, float32 is read in place; points that are not finite
        are skipped. planes: of segment() on the same cloud; None = they are found with distance_threshold (None = half
        the resolution) and min_inliers. K: 3 x 3 camera matrix of an organized cloud; None = estimated.
        origin: (3,), where the sensor stood, for a cloud in the coordinates of the world, in place of T."""
    def insert_depth(
        self,
        image: _Array,
        K: npt.ArrayLike,
        depth_scale: Optional[float] = None,
        T: Optional[npt.ArrayLike] = None,
        *,
        along_ray: bool = False,
        max_depth: float = 8.0,
        distance_threshold: Optional[float] = None,
        min_inliers: Optional[int] = None,
        timestamp: float = 0.0,
    ) -> FrameUpdate:
        """Adds a depth image, (H, W): depth in metres = value / depth_scale; None = floats are metres, integers
        millimetres. 0 and what is not finite = no measurement. along_ray: values are distances along the rays of the
        pixels, not depths along the camera's axis. K: 3 x 3 camera matrix of the rectified image. Points beyond
        max_depth are not mapped. InputError where depths cannot be, all beyond max_depth or all below 1 cm, and
        where the principal point of K is that of images of another size."""
    def merge(self, other: PlanarMap, T: Optional[npt.ArrayLike] = None) -> FrameUpdate:
        """Adds what another map knows; T = T_map_other."""
    def finished(self) -> PlanarMap:
        """The map without what only further frames need: the same answers, a fraction of the bytes."""
    def plans(self, robot: Robot = ..., cell: float = 0.0) -> list[Plan]:
        """The plans of all storeys, the lowest first."""
    def plan(self, robot: Robot = ..., cell: float = 0.0, storey: int = 0) -> Plan: ...
    def cuboids(self) -> _Array:
        """Occupied cuboids: fields center (3), size (3, full lengths), orientation (quaternion x y z w: axes u, v, n to
        the world), plane_id (-1 = none), probability, state."""
    def unknown_cuboids(self) -> _Array:
        """Unknown space, with the fields of cuboids()."""
    def free_cuboids(self) -> _Array:
        """Space that a measurement passed, with the fields of cuboids()."""
    def mesh(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int32]]:
        """Vertices (8 N, 3), metres, and triangles (12 N, 3) of the N cuboids(), counter-clockwise seen from outside:
        rows 8 i ... and 12 i ... belong to cuboid i."""
    def state_of_box(self, low: npt.ArrayLike, high: npt.ArrayLike) -> tuple[int, npt.NDArray[np.int32]]:
        """Of an axis-aligned box with these corners: OCCUPIED if a cuboid meets it, else UNKNOWN if any part is, else
        FREE; and the indices into cuboids() of those that meet it. ParameterError for more than 10 million cells."""
    def snapshot(
        self,
        path: _Path,
        *,
        size: tuple[int, int] = (1280, 720),
        camera: str = "iso",
        color: str = "plane",
        show: Optional[_Sequence[str]] = None,
        plan: bool = False,
        overwrite: bool = False,
    ) -> None:
        """Writes a PNG picture by `planar_map_viewer`, which needs no display. camera: iso, top, front, back, left, right
        or first-person. color: plane, height, probability, state or tilt. show: layers as occupied, unknown,
        trajectory; None = the usual ones. plan: the floor plan instead."""
    def show(self, path: Optional[_Path] = None, *, open_browser: Optional[bool] = None) -> Page:
        """The map in a browser, as a page of its own (path; None = in a temporary folder). open_browser: None = unless
        this is IPython, where a notebook shows the returned page in place."""
    def planes(self) -> _Array:
        """Fields id, frames (in how many it was seen), normal (3), offset, rms: normal . p + offset = 0."""
    def trajectory(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Time stamps (N) and poses T_world_sensor (N, 4, 4) of the frames."""
    def bounds(self) -> Optional[npt.NDArray[np.float64]]:
        """Lowest and highest corner (2, 3) of the occupied cuboids; None without any."""
    def state(self, points: npt.ArrayLike) -> npt.NDArray[np.uint8]:
        """FREE, OCCUPIED or UNKNOWN at (N, 3) points; UNKNOWN where a point is not finite."""
    def probability(self, points: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Belief that (N, 3) points are occupied: 0 where free, 0.5 where unknown."""
    def cast_rays(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        range: float = 100.0,
        *,
        through_unknown: bool = False,
    ) -> _Array:
        """Where each ray first meets what is not free: fields distance (inf = nowhere within range), point (3), cuboid
        (index into cuboids(), -1 = unknown space) and state: of a ray that meets nothing free, or unknown if it
        passed unknown space. origins and directions are (N, 3), or (3) for all rays."""
    @property
    def frames(self) -> int: ...
    @property
    def is_finished(self) -> bool: ...
    @property
    def unknown_cells(self) -> int: ...
    @property
    def memory_bytes(self) -> int: ...
    @property
    def resolution(self) -> float: ...
    @property
    def origin(self) -> npt.NDArray[np.float64]:
        """Coordinates of the world are those of the map plus this (0 but for input in UTM or the like)."""
    def __len__(self) -> int:
        """Number of cuboids()."""

class Page:
    """A page for a browser; a notebook shows it in place."""

    path: str

class Atlas:
    """The store of submaps, keyframes and links (*.atlas), as it was when it was read or solved. Rows are dicts."""

    def __init__(self, path: _Path) -> None:
        """Reads all of it."""
    def sessions(self) -> list[dict[str, Any]]:
        """id, source, configuration."""
    def submaps(self) -> list[dict[str, Any]]:
        """id, session, component, T (T_world_submap, 4 x 4), map (a PlanarMap in the submap's frame)."""
    def keyframes(self) -> list[dict[str, Any]]:
        """id, submap, frame, source, timestamp (seconds), T (T_submap_keyframe, 4 x 4), K (3 x 3), size (width, height),
        features ((N, 3): column, row, inverse depth in 1/m), descriptors ((N, bytes) uint8), inverse_depths ((H, W)
        uint16 of cells, 1/4096 of 1/m, 0 = none), thumbnail (PNG bytes, or empty), points ((N, 3) of a cloud
        without an image, sensor's frame, metres), is_scan (that cloud looks all around)."""
    def links(self) -> list[dict[str, Any]]:
        """id, kind (neighbour, loop or surface), state (used, rejected or refused), from_submap, to_submap, from_keyframe,
        to_keyframe (None = not by keyframes), T (T_to_from, 4 x 4), covariance ((6, 6): x, y, z, rotation about x, y, z),
        inliers, matches, agreement, seen_through, residual."""
    def map(self, component: Optional[int] = None) -> PlanarMap:
        """The submaps of a component joined, in its world; None = the component of the first submap."""
    def trajectory(self, component: Optional[int] = None) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Time stamps (N) and poses T_world_keyframe (N, 4, 4) of the keyframes of a component."""
    def solve(self, *, without_loops: _Sequence[int] = (), with_loops: _Sequence[int] = ()) -> list[int]:
        """Moves the submaps so that the links agree, and writes that. without_loops: ids of loops to refuse for good;
        with_loops: to take back. Returns the ids of submaps that moved."""
    def localize(self, image: npt.NDArray[np.uint8], xyz: npt.ArrayLike, K: npt.ArrayLike) -> Optional[dict[str, Any]]:
        """Where a frame is in the building. image: (H, W) or (H, W, 3) uint8; xyz: (H, W, 3) points of its pixels, metres,
        camera's frame, NaN = none; K: 3 x 3. None = not found, or two places look alike. Else component, session, submap,
        keyframe, T (T_world_sensor, 4 x 4), covariance ((6, 6) of position and rotation, axes of the world), inliers,
        matches, off_plane, log_odds, agreement, seen_through."""
    def localize_scan(self, xyz: npt.ArrayLike) -> Optional[dict[str, Any]]:
        """The same of a scan, which looks all around: (N, 3) points, metres, sensor's frame, NaN = none."""

class Sequence:
    """Frames of files or a folder, recognised by content as `planar_map run` does: clouds, KITTI, TUM RGB-D, EuRoC, ...

    A frame is a dict: name, timestamp (seconds), T (T_world_sensor; None without poses), K (3 x 3 or None), xyz ((N, 3)
    or (H, W, 3) float32, metres, sensor's frame; None of a stereo pair), left (the left or the colour image, (H, W) or
    (H, W, 3) uint8, or None) and right. It is read when it is asked for: `for frame in sequence`.
    """

    def __init__(
        self,
        inputs: Union[_Path, _Sequence[_Path]],
        *,
        poses: Optional[_Path] = None,
        calibration: Optional[_Path] = None,
        scale: float = 1.0,
    ) -> None:
        """inputs: files, or a folder. poses, calibration: files in place of those of the folder. scale: metres a unit of
        the clouds of files."""
    def __len__(self) -> int: ...
    def __getitem__(self, index: int) -> dict[str, Any]: ...
    @property
    def layout(self) -> str:
        """What the input was recognised as."""
    @property
    def notes(self) -> list[str]:
        """What was left out and why."""
    @property
    def calibration(self) -> Optional[dict[str, Any]]:
        """As read_calibration() has it; None without one."""

class Odometry:
    """Poses of clouds that come without and overlap, each from the small planes and edges of those before. Clouds of a
    depth camera are in its frame, z forward."""

    def __init__(self, *, scanner: bool = False, cell: Optional[float] = None) -> None:
        """scanner: clouds of a laser scanner, which looks all around; else of a depth camera. cell: side of the cells in
        which planes are fitted, metres; None = as suits the first cloud."""
    def add(self, xyz: npt.ArrayLike, guess: Optional[npt.ArrayLike] = None) -> Optional[npt.NDArray[np.float64]]:
        """Pose T_world_sensor (4 x 4) of a cloud, (N, 3) or (H, W, 3); None where it is not found for certain: leave such
        a cloud out. guess: where it may be, T_world_sensor, for the first cloud its pose; None = it moves on as before,
        the first is where the world begins."""

def segment(
    xyz: npt.ArrayLike,
    *,
    distance_threshold: Optional[float] = None,
    min_inliers: Optional[int] = None,
    max_planes: int = 0,
    method: str = "automatic",
    seed: int = 12345,
    threads: int = 1,
) -> Segmentation:
    """Finds the planes of a cloud, (N, 3) or organized (H, W, 3). max_planes: 0 = all. method: automatic, organized,
    sequential or multi_ransac. threads: 0 = all cores; the result does not depend on it."""

def approximate(
    xyz: npt.ArrayLike,
    T: Optional[npt.ArrayLike] = None,
    *,
    resolution: Optional[float] = None,
    planes: Optional[Segmentation] = None,
    profile: str = "compact",
    up: Optional[npt.ArrayLike] = None,
    distance_threshold: Optional[float] = None,
    min_inliers: Optional[int] = None,
    threads: int = 1,
) -> _Array:
    """The cuboids of one cloud, with the fields of PlanarMap.cuboids(). up: vertical of the world; None = upwards in the
    image if the cloud is a camera's, else z. Other arguments as PlanarMap.insert() has them."""

def run(
    config: Union[_Path, _Sequence[_Path]],
    inputs: Union[_Path, _Sequence[_Path]],
    out: Optional[_Path] = None,
    *,
    poses: Optional[_Path] = None,
    settings: Mapping[str, Any] = {},
    profile: Optional[str] = None,
    frames: Optional[str] = None,
    threads: Optional[int] = None,
    seed: Optional[int] = None,
    overwrite: bool = False,
    resume: bool = False,
    progress: Optional[Callable[[int, int, dict[str, Any]], None]] = None,
) -> dict[str, Any]:
    """The pipeline, input to map, as `planar_map run CONFIG -i INPUT... -o OUT`: the same files in the folder out.

    run(inputs, out) chooses a ready configuration as `planar_map run INPUT -o OUT` does.

    config: a file, or the name of a ready configuration such as single_pcd.yaml. settings: {"stage.key": value}.
    frames: "first:last:step". progress: called after each frame with the frames done, frames in all (0 = not known) and
    {"source", "planes", "cuboids", "frame_ms"}; what it raises, and Ctrl-C, ends the run after the frame, and what was
    done is saved. Returns the content of metrics.json; what degrades the map is a RuntimeWarning."""

def read_cloud(path: _Path) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float64]]:
    """Points of a PCD or PLY file, (N, 3) or organized (H, W, 3), and the pose of its VIEWPOINT (4 x 4)."""

def read_poses(path: _Path) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Time stamps (N), seconds, and poses (N, 4, 4) of a trajectory in TUM or KITTI format; KITTI's have the numbers of
    their lines for times."""

def read_calibration(path: _Path) -> dict[str, Any]:
    """A calib.yaml: K (3 x 3), size (width, height), baseline (metres, or None), depth_scale (or None), along_ray,
    rectified."""

def columns(table: _Array) -> dict[str, _Array]:
    """Columns of one dimension of a table such as map.cuboids(): center_x, center_y, ..., plane_id. They fit into
    pandas.DataFrame(planar_mapping.columns(map.cuboids()))."""

def read_depth(path: _Path) -> npt.NDArray[np.uint16]:
    """A PNG of one channel of 16 bits, (H, W)."""
