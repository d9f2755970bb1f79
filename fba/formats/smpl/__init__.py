"""SMPL, SMPL-H and SMPL-X motion (AMASS): turns of a body's joints, of its jaw and its eyes.

May use: capture, body.
"""
