"""Geometry in three dimensions: the robot's bodies, the ground, the last touches."""

from gaitshift.show.geometry.frame import Frame as Frame
from gaitshift.show.geometry.frame import frames_of as frames_of
from gaitshift.show.geometry.frame import plane_corners as plane_corners
from gaitshift.show.geometry.meshes import has_meshes as has_meshes
from gaitshift.show.geometry.meshes import put_on as put_on
from gaitshift.show.geometry.shape import Body as Body
from gaitshift.show.geometry.shape import Shape as Shape
from gaitshift.show.geometry.shape import ground_grid as ground_grid
from gaitshift.show.geometry.shape import ground_mesh as ground_mesh
from gaitshift.show.geometry.shape import linear as linear
