"""Sound: files decoded as needed, mixed for the sound device, and recorded into films.

May use: playback.
"""
