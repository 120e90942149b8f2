"""Scenes of USD: what stages hold, placed as USD places it."""

import struct
import zlib

import numpy as np
import pytest

import bth

Usd = pytest.importorskip("pxr.Usd")
from pxr import Gf, Sdf, UsdGeom, UsdLux, UsdShade, UsdUtils, Vt  # noqa: E402

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def cube(stage, path, scheme="none"):
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(CUBE.astype(np.float32)))
    mesh.CreateFaceVertexCountsAttr([4] * 6)
    mesh.CreateFaceVertexIndicesAttr(sum(QUADS, []))
    mesh.CreateSubdivisionSchemeAttr(scheme)
    return mesh


def compiled(stage, **options):
    return bth.usd.compile(stage, quality="fast", cache=False, **options)


def corners(scene, instance=0):
    """The distinct positions of an instance's triangles, sorted."""
    count = scene.triangle_counts[scene.objects_of_instances[instance]]
    return np.unique(scene.triangle_positions(instance, np.arange(count)).reshape(-1, 3).round(5), axis=0)


def test_transforms_over_time_and_the_axis_that_points_up():
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    stage.SetStartTimeCode(1)
    stage.SetEndTimeCode(11)
    stage.SetTimeCodesPerSecond(10)
    arm = UsdGeom.Xform.Define(stage, "/arm")
    arm.AddTranslateOp().Set((0, 0, 5))
    turn = arm.AddRotateZOp()
    turn.Set(0, 1)
    turn.Set(360, 11)
    mesh = cube(stage, "/arm/box")
    mesh.AddTranslateOp().Set((3, 0, 0))
    mesh.AddScaleOp().Set((1, -2, 0.5))
    UsdGeom.Imageable(mesh).GetVisibilityAttr().Set("inherited", 1)
    UsdGeom.Imageable(mesh).GetVisibilityAttr().Set("invisible", 9)
    scene = compiled(stage)
    assert scene.frames == (1, 11, 10.0) and scene.object_count == scene.instance_count == 1
    for frame in (1, 4, 6):
        scene.set_frame(frame)
        world = np.array(UsdGeom.Xformable(mesh).ComputeLocalToWorldTransform(frame))
        expected = CUBE @ world[:3, :3] + world[3, :3]
        expected = np.stack([expected[:, 0], expected[:, 2], -expected[:, 1]], 1)
        np.testing.assert_allclose(corners(scene), np.unique(expected.round(5), axis=0), atol=2e-5)
    assert scene.visible[0]
    scene.set_frame(10)
    assert not scene.visible[0]


def test_instances_are_groups():
    stage = Usd.Stage.CreateInMemory()
    stage.CreateClassPrim("/tree")
    cube(stage, "/tree/leaf").AddTranslateOp().Set((0, 2, 0))
    for k in range(3):
        prim = UsdGeom.Xform.Define(stage, f"/forest/tree{k}")
        prim.AddTranslateOp().Set((10.0 * k, 0, 0))
        prim.GetPrim().GetReferences().AddInternalReference("/tree")
        prim.GetPrim().SetInstanceable(True)
    bare = stage.DefinePrim("/bare")
    bare.GetReferences().AddInternalReference("/tree")
    bare.SetInstanceable(True)
    many = UsdGeom.PointInstancer.Define(stage, "/grass")
    cube(stage, "/grass/prototypes/blade").AddScaleOp().Set((0.1, 1, 0.1))
    many.CreatePrototypesRel().AddTarget("/grass/prototypes/blade")
    many.CreateProtoIndicesAttr([0] * 5)
    many.CreatePositionsAttr([(k, 0, 20) for k in range(5)])
    many.CreateScalesAttr([(1, 1, 1), (2, 2, 2), (0, 0, 0), (1, 1, 1), (1, 1, 1)])
    many.CreateIdsAttr([10, 11, 12, 13, 14])
    many.InvisId(13, Usd.TimeCode.Default())
    scene = compiled(stage)
    shown = np.nonzero(scene.visible)[0]
    assert scene.object_count == 1 and len(shown) == 3 + 1 + 3
    boxes = sorted(tuple(corners(scene, i).mean(axis=0).round(3)) for i in shown)
    assert boxes == sorted([(0, 2, 0), (10, 2, 0), (20, 2, 0), (0, 2, 0), (0, 0, 20), (1, 0, 20), (4, 0, 20)])
    assert all(len(scene.instance_path(i)) > 1 for i in shown)


def test_prototypes_may_be_shown_themselves_and_reset_their_transforms():
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.Xform.Define(stage, "/tools").AddTranslateOp().Set((0, 50, 0))
    cube(stage, "/tools/saw")
    free = cube(stage, "/tools/free")
    free.AddTranslateOp().Set((0, 0, 7))
    free.SetResetXformStack(True)
    many = UsdGeom.PointInstancer.Define(stage, "/copies")
    many.CreatePrototypesRel().SetTargets(["/tools/saw", "/tools"])
    many.CreateProtoIndicesAttr([0, 1])
    many.CreatePositionsAttr([(9, 0, 0), (0, 0, 0)])
    scene = compiled(stage)
    at = sorted(tuple(corners(scene, i).mean(axis=0).round(3)) for i in np.nonzero(scene.visible)[0])
    assert at == sorted([(0, 50, 0), (0, 0, 7), (9, 0, 0), (0, 50, 0), (0, 0, 7)])


def test_subdivision_follows_the_rules():
    stage = Usd.Stage.CreateInMemory()
    soft = cube(stage, "/soft", "catmullClark")
    with pytest.warns(UserWarning, match="control cages") as told:
        assert len(corners(compiled(stage))) == 8 and len(told) == 1
    scene = compiled(stage, subdivision=1)
    assert scene.triangle_counts.tolist() == [48]
    expected = [5 / 9 * CUBE, *(0.75 * v for v in [CUBE * m for m in ([1, 1, 0], [1, 0, 1], [0, 1, 1])]), *(CUBE * m for m in np.eye(3))]
    assert (corners(scene) == np.unique(np.concatenate(expected).round(5), axis=0)).all()
    edges = sorted({tuple(sorted(pair)) for q in QUADS for pair in zip(q, q[1:] + q[:1])})
    soft.CreateCreaseIndicesAttr(sum(map(list, edges), []))
    soft.CreateCreaseLengthsAttr([2] * len(edges))
    soft.CreateCreaseSharpnessesAttr([10.0] * len(edges))
    sharp = compiled(stage, subdivision=3)
    assert np.abs(corners(sharp)).max(axis=1).min() == 1 and sharp.triangle_counts.tolist() == [6 * 64 * 2]
    # Creases of sharpness 1 are sharp for one level.
    soft.GetCreaseSharpnessesAttr().Set([1.0] * len(edges))
    first, second = (corners(compiled(stage, subdivision=k)) for k in (1, 2))
    assert (CUBE[:, None] == first).all(axis=-1).any(axis=1).all() and not (CUBE[:, None] == second).all(axis=-1).any()
    sheet = UsdGeom.Mesh.Define(stage, "/sheet")
    sheet.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    sheet.CreateFaceVertexCountsAttr([4])
    sheet.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    stage.RemovePrim("/soft")
    assert [0, 0, 0] in corners(compiled(stage, subdivision=2)).tolist()
    sheet.CreateInterpolateBoundaryAttr("edgeOnly")
    assert [0, 0, 0] not in corners(compiled(stage, subdivision=2)).tolist()


def png(texel):
    chunk = lambda kind, body: struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    header = struct.pack(">IIBBBBB", 1, 1, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"\0" + bytes(texel))) + chunk(b"IEND", b"")


def test_preview_materials_with_textures_also_in_usdz(tmp_path):
    (tmp_path / "red.png").write_bytes(png([255, 0, 0]))
    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    mesh = cube(stage, "/box")
    st = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("map1", Sdf.ValueTypeNames.TexCoord2fArray, "faceVarying")
    st.Set([(0, 0), (0.25, 0), (0.25, 1), (0, 1)] * 6)
    material = UsdShade.Material.Define(stage, "/looks/paint")
    surface = UsdShade.Shader.Define(stage, "/looks/paint/surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    surface.CreateInput("metallic", Sdf.ValueTypeNames.Float).Set(1.0)
    surface.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(0.25)
    surface.CreateInput("emissiveColor", Sdf.ValueTypeNames.Color3f).Set((0, 4, 2))
    texture, reader = (UsdShade.Shader.Define(stage, f"/looks/paint/{name}") for name in ("texture", "reader"))
    texture.CreateIdAttr("UsdUVTexture")
    texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set("red.png")
    texture.CreateInput("wrapS", Sdf.ValueTypeNames.Token).Set("clamp")
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("map1")
    to = lambda shader, name: UsdShade.ConnectableAPI(shader).CreateOutput(name, Sdf.ValueTypeNames.Token)
    texture.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(to(reader, "result"))
    surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(to(texture, "rgb"))
    material.CreateSurfaceOutput().ConnectToSource(to(surface, "surface"))
    glass = UsdShade.Material.Define(stage, "/looks/glass")
    clear = UsdShade.Shader.Define(stage, "/looks/glass/surface")
    clear.CreateIdAttr("UsdPreviewSurface")
    clear.CreateInput("opacity", Sdf.ValueTypeNames.Float).Set(0.5)
    glass.CreateSurfaceOutput().ConnectToSource(to(clear, "surface"))
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
    subset = UsdShade.MaterialBindingAPI(mesh.GetPrim()).CreateMaterialBindSubset("front", Vt.IntArray([5]))
    UsdShade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(glass)
    stage.GetRootLayer().Save()
    package = str(tmp_path / "a.usdz")
    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "a.usda"), package)
    for path in (tmp_path / "a.usda", package):
        scene = compiled(path)
        paint, clear = scene.materials()
        assert (paint.name, clear.name, clear.alpha, clear.base_color[3]) == ("/looks/paint", "/looks/glass", "blend", 0.5)
        assert (paint.gloss.metallic, paint.gloss.roughness) == (1.0, 0.25) and np.allclose(paint.emissive, [0, 4, 2])
        [texture] = scene.textures()
        assert texture.data == png([255, 0, 0]) and texture.wrap == ("clamp", "repeat") and paint.base_color_texture == 0
        hits = scene.nearest([[0.5, 0.0, 9], [9, 0.0, 0.5]], [[0, 0, -1], [-1, 0, 0]])
        assert hits.material_name.tolist() == ["/looks/glass", "/looks/paint"] and ((hits.texcoord[1] >= 0) & (hits.texcoord[1] <= [0.25, 1])).all()
        texcoord = hits.texcoord[1]
    # It looks the same if its points move.
    for frame, size in ((0, 1), (3, 2)):
        mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(size * CUBE.astype(np.float32)), frame)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(3)
    still, scene = scene, compiled(stage)
    scene.set_frame(3)
    assert repr(scene.materials()) == repr(still.materials()) and len(scene.textures()) == 1
    assert scene.textures()[0].wrap == texture.wrap
    hits = scene.nearest([[1.0, 0.0, 9], [9, 0.0, 1.0]], [[0, 0, -1], [-1, 0, 0]])
    assert hits.t.tolist() == [7, 7] and hits.material_name.tolist() == [clear.name, paint.name]
    assert np.allclose(hits.texcoord[1], texcoord)


def test_cameras_and_lights(tmp_path):
    toml = pytest.importorskip("tomllib")
    stage = Usd.Stage.CreateInMemory()
    cube(stage, "/box")
    camera = UsdGeom.Camera.Define(stage, "/eye")
    camera.SetFromCamera(Gf.Camera(horizontalAperture=36, verticalAperture=24, focalLength=12))
    camera.AddTranslateOp().Set((0, 0, 9))
    sun = UsdLux.DistantLight.Define(stage, "/sun")
    sun.CreateIntensityAttr(100)
    sun.CreateExposureAttr(1)
    sun.CreateNormalizeAttr(True)
    bulb = UsdLux.SphereLight.Define(stage, "/bulb")
    bulb.CreateRadiusAttr(0.5)
    UsdLux.ShapingAPI.Apply(bulb.GetPrim()).CreateShapingConeAngleAttr(30)
    UsdLux.RectLight.Define(stage, "/window").CreateIntensityAttr(5)
    UsdLux.DomeLight.Define(stage, "/sky")
    UsdGeom.BasisCurves.Define(stage, "/hair")
    made = bth.usd.convert(stage, tmp_path)
    assert made.dropped == {
        "lights of the type DomeLight": 1, "prims of the type BasisCurves": 1, "area lights: they shine from both sides": 1,
    }
    with open(made.manifest, "rb") as file:
        scene = toml.load(file)
    [eye] = scene["cameras"]
    assert eye["fov"] == pytest.approx(90) and eye["aspect"] == pytest.approx(1.5) and eye["node"] == "/eye"
    sun, bulb = sorted(scene["lights"], key=lambda light: light["kind"])
    assert (sun["kind"], sun["intensity"], bulb["kind"], bulb["outer"]) == ("directional", 200.0, "spot", 30.0)
    compiled = bth.compile(made.manifest, materials=True, cache=False)
    assert compiled.object_count == 2 and max(max(m.emissive) for k in (0, 1) for m in compiled.materials(k)) == 5


# A mesh of two triangles, two joints above each other, and a shape, all of which move.
BODY = """#usda 1.0
( startTimeCode = 1
  endTimeCode = 5 )
def Xform "world" {
def SkelRoot "body" {
    double3 xformOp:translate = (0, 0, 4)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Skeleton "bones" (prepend apiSchemas = ["SkelBindingAPI"]) {
        uniform token[] joints = ["a", "a/b"]
        uniform matrix4d[] bindTransforms = [ONE, UP]
        uniform matrix4d[] restTransforms = [ONE, UP]
        rel skel:animationSource = <move>
        double xformOp:rotateY = 90
        uniform token[] xformOpOrder = ["xformOp:rotateY"]
        def SkelAnimation "move" {
            uniform token[] joints = ["a", "a/b"]
            float3[] translations.timeSamples = {
                1: [(0, 0, 0), (0, 2, 0)], 5: [(1, 0, 0), (0, 2, 0)]
            }
            quatf[] rotations.timeSamples = {
                1: [(1, 0, 0, 0), (1, 0, 0, 0)], 5: [(1, 0, 0, 0), (0.70710678, 0, 0, 0.70710678)]
            }
            half3[] scales = [(1, 1, 1), (1, 1, 1)]
            uniform token[] blendShapes = ["bulge"]
            float[] blendShapeWeights.timeSamples = {1: [0.5], 5: [1]}
        }
    }
    def Mesh "skin" (prepend apiSchemas = ["SkelBindingAPI"]) {
        uniform token subdivisionScheme = "none"
        int[] faceVertexCounts = [3, 3]
        int[] faceVertexIndices = [0, 1, 2, 2, 1, 3]
        point3f[] points = [(0, 0, 0), (1, 1, 0), (0, 3, 0), (1, 4, 0)]
        normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1)]
        matrix4d primvars:skel:geomBindTransform = DOWN
        int[] primvars:skel:jointIndices = [0, 1, 0, 1, 0, 1, 1, 0] (PAIRS)
        float[] primvars:skel:jointWeights = [1, 0, 0.5, 0.5, 0.25, 0.75, 1, 0] (PAIRS)
        rel skel:skeleton = <../bones>
        uniform token[] skel:blendShapes = ["bulge"]
        rel skel:blendShapeTargets = <bulge>
        double3 xformOp:translate.timeSamples = {1: (7, 0, 0), 5: (9, 0, 0)}
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def BlendShape "bulge" {
            uniform vector3f[] offsets = [(0, 0, 2), (0, 1, 0)]
            uniform int[] pointIndices = [1, 3]
        }
    }
}
}
"""
for word, text in {
    "ONE": "((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))",
    "UP": "((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 2, 0, 1))",
    "DOWN": "((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, -1, 0, 1))",
    "PAIRS": 'elementSize = 2; interpolation = "vertex"',
}.items():
    BODY = BODY.replace(word, text)


def body_at(frame):
    """The triangles of BODY, by the formula of blend shapes and linear blends."""
    share = (frame - 1) / 4
    points = np.array([[0, 0, 0], [1, 1, 0], [0, 3, 0], [1, 4, 0]], float)
    points[1, 2] += 2 * (0.5 + share / 2)
    points[3, 1] += 0.5 + share / 2
    points[:, 1] -= 1
    sin, cos = np.sin(np.pi / 2 * share), np.cos(np.pi / 2 * share)
    first = points + [share, 0, 0]
    second = (points - [0, 2, 0]) @ [[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]] + [share, 2, 0]
    weight = np.array([[0], [0.5], [0.75], [1]])
    x, y, z = ((1 - weight) * first + weight * second).T
    return np.stack([z, y, 4 - x], 1)[[[0, 1, 2], [2, 1, 3]]]


def test_skins_and_blend_shapes_move(tmp_path):
    (tmp_path / "body.usda").write_text(BODY)
    stage = Usd.Stage.Open(str(tmp_path / "body.usda"))
    made = bth.usd.convert(stage, tmp_path / "made")
    assert made.dropped == {"normals of meshes with skins": 1}
    scene = bth.compile(made.manifest, quality="fast", cache=False)
    for frame in (1, 2, 3, 5):
        scene.set_frame(frame)
        np.testing.assert_allclose(scene.triangle_positions(0, [0, 1]), body_at(frame), atol=2e-6)
    # One frame: a still mesh, posed.
    stage.SetStartTimeCode(4)
    stage.SetEndTimeCode(4)
    made = bth.usd.convert(stage, tmp_path / "still")
    scene = bth.compile(made.manifest, quality="fast", cache=False)
    np.testing.assert_allclose(scene.triangle_positions(0, [0, 1]), body_at(4), atol=2e-6)
    assert not list((tmp_path / "still").glob("*.pc2"))
    # A skin that does not fit its points is not applied.
    skin = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/world/body/skin"))
    skin.GetPrimvar("skel:jointWeights").Set([1.0, 0.0])
    with pytest.warns(UserWarning, match="1 × skins that USD does not apply"):
        bound = compiled(stage).triangle_positions(0, [1])
    assert bound[0, 0].tolist() == [8.5, 3, 4]


def test_skins_in_instances(tmp_path):
    (tmp_path / "body.usda").write_text(BODY)
    stage = Usd.Stage.CreateInMemory()
    stage.SetStartTimeCode(1)
    stage.SetEndTimeCode(5)
    many = UsdGeom.PointInstancer.Define(stage, "/many")
    many.CreatePrototypesRel().AddTarget("/many/one")
    many.CreateProtoIndicesAttr([0, 0])
    many.CreatePositionsAttr([(60, 0, 0), (80, 0, 0)])
    paths = {"/x0": "/world", "/x20": "/world", "/x40": "/world/body", "/many/one": "/world"}
    for path, source in paths.items():
        prim = stage.DefinePrim(f"{path}/it")
        prim.GetReferences().AddReference(str(tmp_path / "body.usda"), source)
        prim.SetInstanceable(path != "/many/one")
        if path != "/many/one":
            UsdGeom.Xform.Define(stage, path).AddTranslateOp().Set((float(path[2:]), 0, 0))
    scene = compiled(stage)
    shown = np.nonzero(scene.visible)[0]
    # Instances are groups, but not SkelRoots, which may have another pose each time.
    assert sum(len(scene.instance_path(i)) > 1 for i in shown) == 4
    for frame in (5, 2):
        scene.set_frame(frame)
        found = [scene.triangle_positions(i, [0, 1]) for i in shown]
        found.sort(key=lambda at: at[..., 0].min())
        for k, at in enumerate(found):
            np.testing.assert_allclose(at, body_at(frame) + [20 * k, 0, 0], atol=1e-5)
        assert len(found) == 5


def test_points_that_move():
    stage = Usd.Stage.CreateInMemory()
    stage.SetStartTimeCode(10)
    stage.SetEndTimeCode(14)
    soft = cube(stage, "/soft", "catmullClark")
    points = soft.GetPointsAttr()
    for frame, size in ((10, 1), (12, 3), (14, 2)):
        points.Set(Vt.Vec3fArray.FromNumpy((CUBE * [1, size, 1]).astype(np.float32)), frame)
    still = Usd.Stage.CreateInMemory()
    same = cube(still, "/soft", "catmullClark").GetPointsAttr()
    for levels in (0, 1):
        scene = compiled(stage, subdivision=levels)
        for frame in (10, 11, 12, 14):
            same.Set(points.Get(frame))
            scene.set_frame(frame)
            expected = compiled(still, subdivision=levels)
            rows = np.arange(expected.triangle_counts[0])
            assert (scene.triangle_positions(0, rows) == expected.triangle_positions(0, rows)).all()
    # Faces that change show the first frame.
    soft.GetFaceVertexCountsAttr().Set([4] * 6, 10)
    soft.GetFaceVertexCountsAttr().Set([3] * 8, 12)
    with pytest.warns(UserWarning, match="1 × meshes whose faces or number of points change: shown"):
        scene = compiled(stage)
    scene.set_frame(14)
    assert scene.triangle_counts.tolist() == [12] and np.abs(corners(scene)).max() == 1


def test_colors_stay_with_points_that_move():
    stage = Usd.Stage.CreateInMemory()
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(2)
    mesh = cube(stage, "/soft")
    for frame in (0, 2):
        mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy((CUBE * [1, 1 + frame, 1]).astype(np.float32)), frame)
    colors = mesh.CreateDisplayColorPrimvar("vertex")
    colors.Set(Vt.Vec3fArray.FromNumpy(((CUBE + 1) / 2).astype(np.float32)))
    scene = compiled(stage, materials=True)
    for frame in (0, 1, 2):
        scene.set_frame(frame)
        hits = scene.nearest([[0.5, 9, 0.25], [-0.75, 9, -0.5]], [0, -1, 0])
        np.testing.assert_allclose(9 - hits.t, 1 + frame)
        np.testing.assert_allclose(hits.vertex_color, [[0.75, 1, 0.625, 1], [0.125, 1, 0.25, 1]], atol=1e-6)


def test_what_usd_cannot_open_is_refused_with_its_place(tmp_path):
    (tmp_path / "a.usda").write_text('#usda 1.0\n\ndef Mesh "a" {\n    point3f[] points = [(0, 0]\n}\n')
    with pytest.raises(ValueError, match=r"a\.usda: USD cannot open it: .*a\.usda:4:"):
        bth.usd.compile(tmp_path / "a.usda")
    with pytest.raises(FileNotFoundError):
        bth.usd.compile(tmp_path / "b.usd")
    with pytest.raises(ValueError, match="subdivision"):
        bth.usd.convert(tmp_path / "a.usda", tmp_path, subdivision=9)


def test_odd_ranges_of_time_are_cut(tmp_path):
    for start, end, what in [(0, 1e9, "frames after the first 100,000"), (2**25, 2**25, "ranges of time codes beyond 24 bits"), (5, 1, None)]:
        stage = Usd.Stage.CreateInMemory()
        cube(stage, "/box")
        stage.SetStartTimeCode(start)
        stage.SetEndTimeCode(end)
        made = bth.usd.convert(stage, tmp_path)
        assert list(made.dropped) == ([what] if what else [])
        assert bth.compile(made.manifest, cache=False).instance_count == 1


def test_command(tmp_path, capsys):
    from bth.__main__ import main

    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    cube(stage, "/box")
    UsdGeom.Points.Define(stage, "/dust")
    stage.GetRootLayer().Save()
    assert main(["usd", str(tmp_path / "a.usda"), "-o", str(tmp_path / "folder")]) == 0
    out = capsys.readouterr().out
    assert "a.manifest" in out and "1 × prims of the type Points" in out
    assert bth.compile(tmp_path / "folder" / "a.manifest", cache=False).triangle_counts.tolist() == [12]
    assert main(["usd", str(tmp_path / "a.usda"), "-o", str(tmp_path / "a.bth"), "--subdivision", "1"]) == 0
    assert "warning: 1 × prims of the type Points" in capsys.readouterr().err
    assert bth.open(tmp_path / "a.bth").instance_count == 1


def test_messy_meshes_are_counted():
    stage = Usd.Stage.CreateInMemory()
    cube(stage, "/good")
    cube(stage, "/few").CreateFaceVertexCountsAttr([4] * 7)
    cube(stage, "/far").CreateFaceVertexIndicesAttr([99] * 24)
    cube(stage, "/none").CreatePointsAttr([])
    cube(stage, "/hole").CreateHoleIndicesAttr([0, 1, 2, 3, 4])
    UsdGeom.Xform.Define(stage, "/lost").GetPrim().GetReferences().AddReference("nowhere.usda")
    with pytest.warns(UserWarning) as told:
        scene = compiled(stage)
    assert [str(one.message) for one in told] == ["1 × references and layers that are missing or broken", "3 × meshes without usable faces"]
    assert sorted(scene.triangle_counts[scene.objects_of_instances].tolist()) == [2, 12]
