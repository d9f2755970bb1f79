"""Commands below a command, such as `fba model learn-fit`; the commands themselves import them."""
