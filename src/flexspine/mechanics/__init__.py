"""From symbols to equations of motion; knows neither events nor legs."""
