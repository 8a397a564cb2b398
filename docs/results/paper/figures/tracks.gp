set encoding utf8
set terminal pngcairo noenhanced size 1200,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'tracks.png'
set datafile separator comma
set title 'Three tracks'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key outside right top
set xlabel 'speed limit [m/s]'
set xrange [6.3:7.7]
set ylabel 'races won [%]'
set yrange [0:105]
plot 'tracks.csv' skip 1 every ::0::0 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#0072b2' title 'Track A: circle, gates turned', \
     'tracks.csv' skip 1 every ::0::0 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#0072b2' notitle, \
     'tracks.csv' skip 1 every ::1::1 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#d55e00' title 'Track B: the same waypoints, gates turned differently', \
     'tracks.csv' skip 1 every ::1::1 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#d55e00' notitle, \
     'tracks.csv' skip 1 every ::2::2 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#009e73' title 'Track C: figure-eight', \
     'tracks.csv' skip 1 every ::2::2 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#009e73' notitle
