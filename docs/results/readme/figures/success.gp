set encoding utf8
set terminal pngcairo noenhanced size 1200,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'success.png'
set datafile separator comma
set title 'Three laps on depth alone: success'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key outside right top
set xlabel 'speed limit [m/s]'
set xrange [6.75:12.25]
set ylabel 'races won [%]'
set yrange [0:105]
plot 'success.csv' skip 1 every ::0::0 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#0072b2' title 'no perturbation', \
     'success.csv' skip 1 every ::0::0 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#0072b2' notitle, \
     'success.csv' skip 1 every ::1::1 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#d55e00' title 'position 0.3 m', \
     'success.csv' skip 1 every ::1::1 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#d55e00' notitle, \
     'success.csv' skip 1 every ::2::2 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#009e73' title 'position 0.5 to 0.6 m', \
     'success.csv' skip 1 every ::2::2 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#009e73' notitle, \
     'success.csv' skip 1 every ::3::3 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#cc79a7' title 'position 1.0 m', \
     'success.csv' skip 1 every ::3::3 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#cc79a7' notitle, \
     'success.csv' skip 1 every ::4::4 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#e69f00' title 'yaw 30 deg', \
     'success.csv' skip 1 every ::4::4 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#e69f00' notitle, \
     'success.csv' skip 1 every ::5::5 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#56b4e9' title 'yaw 60 deg', \
     'success.csv' skip 1 every ::5::5 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#56b4e9' notitle, \
     'success.csv' skip 1 every ::6::6 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#000000' title 'position 0.5 m and yaw 30 deg', \
     'success.csv' skip 1 every ::6::6 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#000000' notitle, \
     'success.csv' skip 1 every ::7::7 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#0072b2' title 'tilt 30 deg', \
     'success.csv' skip 1 every ::7::7 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#0072b2' notitle, \
     'success.csv' skip 1 every ::8::8 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#d55e00' title 'one gate, 0.75 m and 40 deg', \
     'success.csv' skip 1 every ::8::8 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#d55e00' notitle, \
     'success.csv' skip 1 every ::9::9 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#009e73' title 'stereo-matched sensor, position 0.3 m', \
     'success.csv' skip 1 every ::9::9 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#009e73' notitle, \
     'success.csv' skip 1 every ::10::10 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#cc79a7' title '50 ms delay each way, position 0.3 m', \
     'success.csv' skip 1 every ::10::10 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#cc79a7' notitle, \
     'success.csv' skip 1 every ::11::11 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#e69f00' title 'mass +10 %, drag x1.5, rotor lag x1.5, wind 4 m/s, position 0.3 m', \
     'success.csv' skip 1 every ::11::11 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#e69f00' notitle
