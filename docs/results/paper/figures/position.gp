set encoding utf8
set terminal pngcairo noenhanced size 1200,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'position.png'
set datafile separator comma
set title 'Success against speed, gates displaced'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key outside right top
set xlabel 'speed limit [m/s]'
set xrange [4.13:14.47]
set ylabel 'races won [%]'
set yrange [0:105]
plot 'position.csv' skip 1 every ::0::6 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#0072b2' title 'no perturbation', \
     'position.csv' skip 1 every ::0::6 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#0072b2' notitle, \
     'position.csv' skip 1 every ::7::13 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#d55e00' title 'position 0.3 m', \
     'position.csv' skip 1 every ::7::13 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#d55e00' notitle, \
     'position.csv' skip 1 every ::14::20 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#009e73' title 'position 0.5 to 0.6 m', \
     'position.csv' skip 1 every ::14::20 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#009e73' notitle, \
     'position.csv' skip 1 every ::21::25 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#cc79a7' title 'position 1.0 m', \
     'position.csv' skip 1 every ::21::25 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#cc79a7' notitle, \
     'position.csv' skip 1 every ::26::26 using 2:3 with points pt 7 ps 0.9 lc rgb '#e69f00' title 'Zhao et al.: no perturbation', \
     'position.csv' skip 1 every ::27::27 using 2:3 with points pt 7 ps 0.9 lc rgb '#56b4e9' title 'RL, best environment: no perturbation', \
     'position.csv' skip 1 every ::28::29 using 2:3 with points pt 7 ps 0.9 lc rgb '#000000' title 'Zhao et al.: position 0.3 m', \
     'position.csv' skip 1 every ::30::30 using 2:3 with points pt 7 ps 0.9 lc rgb '#0072b2' title 'RL, best environment: position 0.3 m', \
     'position.csv' skip 1 every ::31::32 using 2:3 with points pt 7 ps 0.9 lc rgb '#d55e00' title 'Zhao et al.: position 0.5 to 0.6 m', \
     'position.csv' skip 1 every ::33::33 using 2:3 with points pt 7 ps 0.9 lc rgb '#009e73' title 'RL, best environment: position 0.5 to 0.6 m'
