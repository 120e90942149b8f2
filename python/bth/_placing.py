"""Moving, adding, hiding and removing of instances, and adding of objects."""

import numpy as np

from . import _arrays, _meshes, _native


def _ids(instances, name="instances"):
    """Indices of instances or objects as the native module takes them, (n,)."""
    return np.ascontiguousarray(_arrays.indices(instances, name).reshape(-1))


class Placing:
    """The calls that place instances.

    Nothing is compiled or built for an object, and answers are those of a scene compiled with these
    transforms. Instances keep their index until they are removed. All of a call's changes become
    visible, or none if it fails. Scenes that move by the tracks of their file are refused with a
    ValueError.
    """

    __slots__ = ()

    def set_transforms(self, instances, matrices):
        """Moves instances.

        instances: an index or indices (n,).
        matrices: from the object's space to world space, applied to columns; (n, 4, 4),
        (n, 3, 4), or one for all.
        """
        instances = _ids(instances)
        _native.set_transforms(
            self._native, instances, _meshes.matrices_of(matrices, len(instances), "matrices")
        )

    def add_objects(self, scene):
        """Adds the objects of another scene, without instances of them, and compiles nothing.

        scene: a Scene. Its objects have the positions of its file; its masks have no effect here.

        Returns their indices as a range, for `add_instances`. Their memory is shared with `scene`,
        which may be closed. Objects stay until this scene is closed. `save` and `to_bytes` give the
        file without them.
        """
        return range(*_native.add_objects(self._native, scene._native))

    def add_instances(self, obj=0, matrices=None):
        """Adds instances of objects of the scene.

        obj: the index of an object, or indices (n,).
        matrices: as for `set_transforms`; by default the identity.

        Returns the index of the new instance, or indices (n,) uint32. Indices of removed instances
        are used again, the lowest first.
        """
        matrices = np.eye(4) if matrices is None else _arrays.plain(matrices, "matrices")
        shape = np.broadcast_shapes(np.shape(obj), matrices.shape[:-2])
        objects = _ids(np.broadcast_to(_arrays.indices(obj, "obj"), shape), "obj")
        ids = _native.add_instances(
            self._native, objects, _meshes.matrices_of(matrices, len(objects), "matrices")
        )
        self._looked_for_open = False
        return np.array(ids, np.uint32).reshape(shape) if shape else ids[0]

    def remove_instances(self, instances):
        """Removes instances, an index or indices (n,). Others keep their index."""
        _native.remove_instances(self._native, _ids(instances))

    def set_visible(self, instances, visible=True):
        """Shows or hides instances: an index or indices (n,), and one truth value or (n,).

        Hidden ones keep their index and transform.
        """
        instances = _ids(instances)
        _native.set_visible(
            self._native,
            instances,
            np.array(np.broadcast_to(np.asarray(visible, bool), len(instances))),
        )
        self._looked_for_open = False

    # For pickles.

    def _placement(self):
        """What `_place` takes: None if the file places the instances."""
        return (
            (
                _native.added_files(self._native),
                *(self.objects_of_instances, self.transforms, self.visible, self.instance_names),
            )
            if self._native.placed
            else None
        )

    def _place(self, files, objects, transforms, visible, names):
        """Places the instances of a file that was just opened as another scene of it has them."""
        for file in files:
            _native.add_objects(self._native, _native.load(file))
        count, none = self.instance_count, objects == 0xFFFFFFFF
        kept = (self.objects_of_instances == objects[:count]) & (
            np.array(self.instance_names, object) == np.array(names[:count], object)
        )
        self.remove_instances(np.nonzero(~kept)[0])
        # The indices that are free are given in ascending order.
        missing = np.append(np.nonzero(~kept)[0], np.arange(count, len(objects)))
        if len(missing):
            self.add_instances(np.where(none, 0, objects)[missing])
        self.set_visible(np.arange(len(objects)), False)
        self.set_transforms(np.arange(len(objects)), transforms)
        self.set_visible(np.nonzero(visible)[0])
        self.remove_instances(np.nonzero(none)[0])
