"""Body models made from the files of other programs."""

from fba.body.importers._makehuman import import_makehuman

__all__ = ["import_makehuman"]
